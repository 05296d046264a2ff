"""Shows a recording or a result of zsim in Rerun: python rerun_view.py FILE.mcap [OUT.rrd]

With OUT.rrd it writes file and layout for the viewer instead of starting it. Needs `pip install rerun-sdk`.
"""

import sys

import rerun as rr
import rerun.blueprint as rrb

LAYOUT = rrb.Blueprint(
    rrb.Horizontal(
        rrb.Spatial3DView(origin="/", name="Map, scans and trajectory"),
        rrb.Vertical(
            rrb.TimeSeriesView(origin="/imu/data_raw", name="IMU: rad/s and m/s^2"),
            rrb.TextLogView(origin="/", name="Log"),
            row_shares=[3, 1],
        ),
        column_shares=[2, 1],
    ),
    collapse_panels=True,
)


def main() -> None:
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    rr.init("zsim", spawn=len(sys.argv) == 2)
    if len(sys.argv) == 3:
        rr.save(sys.argv[2], default_blueprint=LAYOUT)
    rr.send_blueprint(LAYOUT)
    rr.log_file_from_path(sys.argv[1])


if __name__ == "__main__":
    main()
