use super::*;

const START_MS: i64 = 1_700_000_000_000;

fn at(ms: i64) -> Stamp {
    Stamp::from_nanos((START_MS + ms) * 1_000_000)
}

/// Log time and stamp of messages, ms; the output is each message's number and stamp, ms.
fn screened(messages: &[(i64, i64)]) -> (Vec<(usize, i64)>, StampScreen<usize>) {
    let (mut screen, mut out) = (StampScreen::default(), Vec::new());
    let stamp = |k: usize, shift: Span| (k, (at(messages[k].1) - shift).nanos() / 1_000_000 - START_MS);
    for (k, (log, stamped)) in messages.iter().enumerate() {
        screen.push((at(*log), at(*stamped)), k, None, &mut |k, shift| out.push(stamp(k, shift)));
    }
    screen.finish(&mut |k, shift| out.push(stamp(k, shift)));
    (out, screen)
}

/// Messages every 10 ms, logged with a delay of 2 to 9 ms.
fn regular(count: i64) -> Vec<(i64, i64)> {
    (0..count).map(|k| (10 * k + 2 + k * 5 % 8, 10 * k)).collect()
}

#[test]
fn stamps_of_zero_and_lone_outliers_are_dropped_anywhere() {
    for (index, stamp_ms) in
        [(0, -START_MS), (0, -3_600_000), (50, -START_MS), (50, 86_400_000), (99, -3000), (99, 5000)]
    {
        let mut messages = regular(100);
        messages[index].1 = stamp_ms;
        let (out, screen) = screened(&messages);
        assert_eq!((screen.outliers, screen.steps.len()), (1, 0), "{index}: {stamp_ms}");
        let expected: Vec<_> = (0..100).filter(|k| *k != index).map(|k| (k, 10 * k as i64)).collect();
        assert_eq!(out, expected, "{index}: {stamp_ms}");
    }
    // Five at the start, and for ever.
    for zeros in [0..5, 60..100] {
        let mut messages = regular(100);
        messages[zeros.clone()].iter_mut().for_each(|(_, stamp)| *stamp = -START_MS);
        let (out, screen) = screened(&messages);
        assert_eq!((out.len(), screen.outliers as usize), (100 - zeros.len(), zeros.len()));
    }
}

#[test]
fn an_outlier_is_dropped_where_log_times_are_copies_of_the_stamps() {
    let mut messages: Vec<(i64, i64)> = (0..100).map(|k| (10 * k, 10 * k)).collect();
    messages[0] = (-START_MS, -START_MS);
    let (out, screen) = screened(&messages);
    assert_eq!((out.len(), screen.outliers), (99, 1));
}

#[test]
fn a_step_of_the_clock_is_removed_to_the_period() {
    for by_ms in [-5000, -300, 250, 37_000, 86_400_000] {
        let mut messages = regular(200);
        messages[100..].iter_mut().for_each(|(_, stamp)| *stamp += by_ms);
        let (out, screen) = screened(&messages);
        let [step] = screen.steps[..] else { panic!("{by_ms}: {:?}", screen.steps) };
        assert_eq!((step.by.nanos() / 1_000_000, screen.outliers), (by_ms, 0));
        assert_eq!(out, (0..200).map(|k| (k, 10 * k as i64)).collect::<Vec<_>>());
    }
}

#[test]
fn a_clock_that_is_set_twice_is_followed() {
    let mut messages = regular(300);
    messages[100..].iter_mut().for_each(|(_, stamp)| *stamp += 2000);
    messages[200..].iter_mut().for_each(|(_, stamp)| *stamp -= 2000);
    let (out, screen) = screened(&messages);
    assert_eq!(screen.steps.len(), 2);
    assert_eq!(out, (0..300).map(|k| (k, 10 * k as i64)).collect::<Vec<_>>());
}

#[test]
fn late_messages_and_gaps_are_no_steps() {
    let kept = |messages: &[(i64, i64)]| {
        let (out, screen) = screened(messages);
        assert_eq!((screen.steps.len(), screen.outliers), (0, 0));
        assert_eq!(out.len(), messages.len());
    };
    // The host stalls for 3 s, and then takes what waits at once.
    kept(
        &regular(600)
            .into_iter()
            .map(|(log, stamp)| (if (1000..4000).contains(&log) { 4000 + stamp / 1000 } else { log }, stamp))
            .collect::<Vec<_>>(),
    );
    // It keeps the oldest 50 of these only.
    let stalled = regular(900).into_iter().filter(|(_, stamp)| !(1500..4000).contains(stamp));
    kept(
        &stalled.map(|(log, stamp)| (if (1000..4000).contains(&log) { 4000 } else { log }, stamp)).collect::<Vec<_>>(),
    );
    // The sensor pauses for 5 s, and for an hour.
    for pause_ms in [5000, 3_600_000] {
        kept(
            &regular(200)
                .into_iter()
                .map(|(log, stamp)| if stamp < 1000 { (log, stamp) } else { (log + pause_ms, stamp + pause_ms) })
                .collect::<Vec<_>>(),
        );
    }
    // Log times that are all equal, or whole seconds; a sensor at 4 Hz; a clock that is fast by 500 ppm.
    kept(&regular(500).into_iter().map(|(_, stamp)| (0, stamp)).collect::<Vec<_>>());
    kept(&(0..100).map(|k| (0, 250 * k)).collect::<Vec<_>>());
    kept(&regular(500).into_iter().map(|(log, stamp)| (log / 1000 * 1000 + 1000, stamp)).collect::<Vec<_>>());
    kept(&(0..40_000).map(|k| (10 * k + 3, 10 * k + k / 200)).collect::<Vec<_>>());
}

#[test]
fn messages_in_disorder_are_kept() {
    let mut messages: Vec<(i64, i64)> = (0..300).map(|k| (10 * k + k * 7919 % 13 * 12, 10 * k)).collect();
    messages.sort_unstable();
    let (out, screen) = screened(&messages);
    assert_eq!((out.len(), screen.outliers, screen.steps.len()), (300, 0, 0));
}

#[test]
fn a_message_that_comes_late_is_kept() {
    let mut messages = regular(100);
    messages[50].1 -= 300;
    let (out, screen) = screened(&messages);
    assert_eq!((out.len(), screen.outliers), (100, 0));
}

#[test]
fn a_recording_of_a_few_messages_is_kept() {
    assert_eq!(screened(&regular(4)).0.len(), 4);
}
