#!/usr/bin/env python3
"""check_rosbag2.py FOLDER: checks metadata.yaml of a folder of rosbag2 with `rosbags`.

The metadata must state the messages, times and types that are in the file. Prints one line, `ok ...`; exits with 1 on a
difference, and with 77 if a module is not installed.
"""
import sys

try:
    from rosbags.interfaces import QosDurability
    from rosbags.rosbag2 import Reader
except ImportError as missing:
    print(missing, file=sys.stderr)
    sys.exit(77)


def main(path):
    counts, times = {}, []
    with Reader(path) as bag:
        for connection, time, _ in bag.messages():
            counts[connection.topic] = counts.get(connection.topic, 0) + 1
            times.append(time)
        stated = {topic: of.msgcount for topic, of in bag.topics.items()}
        durability = {c.topic: c.ext.offered_qos_profiles[0].durability for c in bag.connections}
        assert stated == counts, f"{stated} messages, read {counts}"
        assert bag.message_count == len(times), f"{bag.message_count} messages, read {len(times)}"
        assert bag.start_time == min(times), f"starts at {bag.start_time}, read {min(times)}"
        # The end of rosbags is exclusive.
        assert bag.end_time == max(times) + 1, f"ends at {bag.end_time}, read {max(times)}"
    lasting = {topic for topic, kind in durability.items() if kind == QosDurability.TRANSIENT_LOCAL}
    assert lasting == {"/tf_static"}, f"transient local: {lasting}"
    print(f"ok {len(times)} messages, {len(counts)} topics")


main(sys.argv[1])
