//! The horizontal axis of a light curve: marks at whole times of UTC, for spans from milliseconds to years.

use crate::astro::time::{Instant, SECOND_NS};
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use std::ops::Range;

/// Seconds in a day.
const DAY_S: f64 = 86_400.0;
/// Most marks of an axis.
const MOST_MARKS: f64 = 9.0;
/// Steps between marks up to a day \[s\].
const STEPS_S: [f64; 27] = [
    1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0,
    900.0, 1800.0, 3600.0, 7200.0, 10_800.0, 21_600.0, 43_200.0, DAY_S,
];

/// Times without data longer than this are cut out \[s\]: days between nights.
const CUT_S: f64 = 14_400.0;
/// Most pieces that an axis is cut into.
const MOST_PIECES: usize = 8;
/// Room at either end of a piece, in parts of the whole axis.
const ROOM: f64 = 0.02;
/// Least distance of labels, in parts of the whole axis.
const LABEL: f64 = 0.085;

/// An axis: its ends, the marks with their labels, and what it says of itself.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    /// First and last place.
    pub(super) ends: (f64, f64),
    /// Places of the marks and their labels.
    pub(super) marks: Vec<(f64, String)>,
    /// Places where time is cut out.
    pub(super) cuts: Vec<f64>,
    /// Description.
    pub(super) name: String,
    /// First and last time of each piece, with its room, and the place of the first.
    pieces: Vec<(f64, f64, f64)>,
}

impl Axis {
    /// An axis of time for data at these times \[s since `start`\], in order. Without long times without data a place is
    /// a time.
    pub(super) fn of_times(start: &Instant, times: &[f64]) -> Self {
        let runs = times.chunk_by(|a, b| b - a <= CUT_S).filter_map(|run| Some((*run.first()?, *run.last()?)));
        let runs = runs.collect::<Vec<_>>();
        let ends = (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0));
        let runs = if (2..=MOST_PIECES).contains(&runs.len()) { runs } else { vec![ends] };
        let length = runs.iter().map(|run| run.1 - run.0).sum::<f64>();
        let room = if length > 0.0 { ROOM * length } else { 0.5 };
        let mut pieces: Vec<(f64, f64, f64)> = Vec::new();
        for run in &runs {
            let (first, last) = (run.0 - room, run.1 + room);
            let place = pieces.last().map_or(first, |p| p.2 + p.1 - p.0);
            pieces.push((first, last, place));
        }
        let from = pieces.first().map_or(ends.0, |p| p.0);
        let (to, last) = pieces.last().map_or(ends, |p| (p.1, p.2 + p.1 - p.0));
        let day = |t: f64| start.plus(t).utc_reading().iso(0).chars().take(10).collect::<String>();
        let (first_day, last_day) = (day(from), day(to));
        let several = first_day != last_day;
        let name = if several { format!("UTC, {first_day} to {last_day}") } else { format!("UTC, {first_day}") };
        let mut axis = Self {
            ends: (from, last),
            marks: Vec::new(),
            cuts: pieces.iter().skip(1).map(|p| p.2).collect(),
            name,
            pieces,
        };
        axis.mark(start, several);
        axis
    }

    /// Marks at whole times; where time is cut, the first of a piece has the date, and labels keep their distance.
    fn mark(&mut self, start: &Instant, several_days: bool) {
        let whole = self.ends.1 - self.ends.0;
        let step = step_of(whole);
        let cut = self.pieces.len() > 1;
        let mut marks: Vec<(f64, String)> = Vec::new();
        for (from, to, place) in &self.pieces {
            // marks fall on whole steps since midnight of the first day
            let reading = start.plus(*from).utc_reading();
            let midnight = from - reading.ns as f64 / SECOND_NS as f64;
            let first_mark = ((from - midnight) / step).ceil();
            let times = (0..=MOST_MARKS as u32).map(|k| midnight + (first_mark + f64::from(k)) * step);
            let mut times = times.filter(|t| t <= to).collect::<Vec<_>>();
            if times.is_empty() && cut {
                times.push(0.5 * (from + to));
            }
            for (number, time) in times.into_iter().enumerate() {
                let instant = start.plus(time);
                let at = place + time - from;
                let close = cut && marks.last().is_some_and(|m| at - m.0 < LABEL * whole);
                let text = if cut && number == 0 {
                    marks.last_mut().into_iter().filter(|_| close).for_each(|m| m.1.clear());
                    instant.utc_reading().iso(0).get(5..16).unwrap_or("").replace('T', " ")
                } else if close {
                    String::new()
                } else {
                    label(&instant, step, several_days && !cut)
                };
                marks.push((at, text));
            }
        }
        self.marks = marks;
    }

    /// Place of a time \[s\].
    pub(super) fn place(&self, time: f64) -> f64 {
        let piece = self.pieces.iter().find(|p| time <= p.1).or(self.pieces.last());
        piece.map_or(time, |(from, _, place)| place + time - from)
    }

    /// An axis of two turns of phase.
    pub(super) fn of_phase(period_s: f64, epoch: &Instant) -> Self {
        let marks = (0..=8).map(|k| f64::from(k) * 0.25).map(|p| (p, format!("{p:.2}"))).collect();
        let name = format!("phase of the period {period_s:.9} s, 0 at {} UTC; two turns", epoch.iso_utc());
        Self { ends: (0.0, 2.0), marks, cuts: Vec::new(), name, pieces: Vec::new() }
    }

    /// The label at a mark.
    pub(super) fn label(&self, place: f64) -> String {
        self.marks.iter().find(|m| m.0 == place).map_or_else(String::new, |m| m.1.clone())
    }
}

/// Step between marks \[s\] for a span \[s\].
fn step_of(span: f64) -> f64 {
    let least = span / MOST_MARKS;
    let days = (0..7).flat_map(|power| [2.0, 5.0, 10.0].map(|n| n * 10f64.powi(power) * DAY_S));
    STEPS_S.into_iter().chain(days).find(|s| *s >= least).unwrap_or(least)
}

fn label(time: &Instant, step: f64, several_days: bool) -> String {
    let reading = time.utc_reading();
    let decimals = if step < 1.0 { (-step.log10()).ceil().clamp(1.0, 3.0) as u32 } else { 0 };
    let text = reading.iso(decimals);
    let (date, clock) = text.split_once('T').unwrap_or((&text, ""));
    let day = date.get(5..).unwrap_or(date);
    // whole minutes need no seconds
    let clock = if step >= 60.0 && clock.ends_with(":00") { clock.get(..5).unwrap_or(clock) } else { clock };
    match (step >= DAY_S, several_days && clock == "00:00") {
        (true, _) if step >= 200.0 * DAY_S => date.to_owned(),
        (true, _) | (_, true) => day.to_owned(),
        _ => clock.to_owned(),
    }
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let part = (value - self.ends.0) / (self.ends.1 - self.ends.0);
        limit.0 + (part * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.marks.iter().map(|m| m.0).collect()
    }

    fn range(&self) -> Range<f64> {
        self.ends.0..self.ends.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of data without long pauses.
    fn steps(span: f64) -> Vec<f64> {
        let count = (span / CUT_S).ceil().max(1.0) as u32 + 1;
        (0..=count).map(|k| span * f64::from(k) / f64::from(count)).collect()
    }

    fn labels(start: &str, span: f64) -> (Vec<String>, String) {
        let axis = Axis::of_times(&Instant::from_utc(start).unwrap(), &steps(span));
        let whole = axis.marks.iter().all(|m| (axis.ends.0..=axis.ends.1).contains(&m.0));
        assert!(whole && axis.marks.len() <= 10, "{axis:?}");
        (axis.marks.into_iter().map(|m| m.1).collect(), axis.name)
    }

    #[test]
    fn marks_fall_on_whole_times_from_milliseconds_to_years() {
        let (marks, name) = labels("2024-02-29T12:00:00.100", 0.5);
        assert_eq!((marks[0].as_str(), name.as_str()), ("12:00:00.1", "UTC, 2024-02-29"));
        assert_eq!(
            labels("2024-02-29T12:00:03", 60.0).0,
            ["12:00:10", "12:00:20", "12:00:30", "12:00:40", "12:00:50", "12:01:00"]
        );
        let (marks, name) = labels("2024-02-29T22:40:00", 3.0 * 3600.0);
        assert_eq!(marks, ["23:00", "23:30", "03-01", "00:30", "01:00", "01:30"]);
        assert_eq!(name, "UTC, 2024-02-29 to 2024-03-01");
        assert_eq!(
            labels("2024-02-28T20:00:00", 4.0 * DAY_S).0,
            ["02-29", "12:00", "03-01", "12:00", "03-02", "12:00", "03-03", "12:00"]
        );
        assert_eq!(labels("2024-01-01T12:00:00", 1500.0 * DAY_S).0.first().unwrap(), "2024-06-19");
    }

    #[test]
    fn days_between_nights_are_cut_out() {
        let times = [0.0, 1800.0, 3600.0, 86_400.0, 90_000.0];
        let axis = Axis::of_times(&Instant::from_utc("2024-02-29T22:10:00").unwrap(), &times);
        // two hours of data, and four times two hundredths of room
        assert!((axis.ends.1 - axis.ends.0 - 7200.0 * 1.08).abs() < 1e-9, "{axis:?}");
        let places = times.map(|t| axis.place(t));
        assert_eq!(places[..3], times[..3]);
        // the second night follows the first after the room of both
        assert!(
            (places[3] - (3600.0 + 288.0)).abs() < 1e-9 && places[3] > axis.cuts[0] && axis.cuts[0] > places[2]
        );
        let labels = axis.marks.iter().map(|m| m.1.as_str()).collect::<Vec<_>>();
        assert_eq!((labels[0], axis.cuts.len()), ("02-29 22:15", 1), "{labels:?}");
        assert!(labels.contains(&"03-01 22:15"), "{labels:?}");
        // too many nights are not cut
        let nights = (0..20).map(|k| f64::from(k) * DAY_S).collect::<Vec<_>>();
        assert!(Axis::of_times(&Instant::default(), &nights).cuts.is_empty());
    }

    #[test]
    fn any_span_has_marks_or_none_but_no_panic() {
        for span in [0.0, 1e-9, 1.0, 1e5, 1e9, 1e15, f64::MAX, f64::INFINITY, f64::NAN] {
            let axis = Axis::of_times(&Instant::default(), &[0.0, span]);
            assert!(axis.marks.len() <= 10 * (axis.cuts.len() + 1), "{span}");
            let _ = axis.map(&0.5, (0, 1000));
        }
    }
}
