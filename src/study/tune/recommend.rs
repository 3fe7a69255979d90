//! The setting to take.

use super::{Row, picture_front};

/// What is asked of a setting.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Goal {
    /// At most this many bytes of octree.
    pub budget_bytes: Option<u64>,
    /// At least this PSNR in every view, decibels.
    pub target_psnr_db: Option<f64>,
}

/// A recommended row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pick {
    /// What it is recommended as.
    pub name: &'static str,
    /// Its index.
    pub row: usize,
    /// Whether it meets the goal. Where no row does, the one that comes nearest is picked.
    pub meets_goal: bool,
}

/// PSNR differences below this are not seen, decibels; they are worth no byte.
const UNSEEN_DB: f64 = 0.1;

/// Decibels of twice the error.
const TWICE_DB: f64 = 6.02;

/// Picks rows for a goal.
///
/// * A budget: the best picture within it.
/// * A target: the fewest bytes that reach it; with a budget too, within that, and the best picture within it if none reaches the target.
/// * Neither: *large*, the best picture there is; *medium*, the bend of the curve of PSNR over the logarithm of bytes, where more bytes
///   begin to pay less; *small*, the fewest bytes with at most twice the error of medium.
pub fn recommend(rows: &[Row], goal: Goal) -> Vec<Pick> {
    if rows.is_empty() {
        return Vec::new();
    }
    let curve = picture_front(rows, |row| row.bytes as f64);
    match (goal.budget_bytes, goal.target_psnr_db) {
        (None, None) => three(rows, &curve),
        (budget, target) => vec![for_goal(rows, &curve, budget.unwrap_or(u64::MAX), target)],
    }
}

fn for_goal(rows: &[Row], curve: &[usize], budget: u64, target: Option<f64>) -> Pick {
    let within: Vec<usize> = curve.iter().copied().filter(|&i| rows[i].bytes <= budget).collect();
    let reaching = target.and_then(|target| within.iter().copied().find(|&i| rows[i].psnr_db >= target));
    let name = if target.is_some() { "target" } else { "budget" };
    match (reaching, within.last()) {
        (Some(row), _) => Pick { name, row, meets_goal: true },
        (None, Some(_)) => Pick { name, row: finest(rows, &within), meets_goal: target.is_none() },
        (None, None) => Pick { name, row: curve[0], meets_goal: false },
    }
}

/// The fewest bytes whose picture cannot be told from the best one's.
fn finest(rows: &[Row], curve: &[usize]) -> usize {
    let best = rows[curve[curve.len() - 1]].psnr_db;
    curve.iter().copied().find(|&i| rows[i].psnr_db >= best - UNSEEN_DB).unwrap_or(curve[curve.len() - 1])
}

fn three(rows: &[Row], curve: &[usize]) -> Vec<Pick> {
    let large = finest(rows, curve);
    let up_to_large: Vec<usize> = curve.iter().copied().take_while(|&i| rows[i].bytes <= rows[large].bytes).collect();
    let medium = bend(rows, &up_to_large);
    let enough = rows[medium].psnr_db - TWICE_DB;
    let small = up_to_large.iter().copied().find(|&i| rows[i].psnr_db >= enough).unwrap_or(medium);
    let mut picks: Vec<Pick> = Vec::new();
    for (name, row) in [("medium", medium), ("small", small), ("large", large)] {
        if picks.iter().all(|pick| pick.row != row) {
            picks.push(Pick { name, row, meets_goal: true });
        }
    }
    picks.sort_by_key(|pick| rows[pick.row].bytes);
    picks
}

/// The row of the curve that lies farthest above the chord from its first to its last.
fn bend(rows: &[Row], curve: &[usize]) -> usize {
    let at = |i: usize| ((rows[i].bytes as f64).log2(), rows[i].psnr_db);
    let (first, last) = (at(curve[0]), at(curve[curve.len() - 1]));
    let slope = if last.0 > first.0 { (last.1 - first.1) / (last.0 - first.0) } else { 0.0 };
    let above = |i: usize| at(i).1 - first.1 - slope * (at(i).0 - first.0);
    let inner = &curve[1..curve.len().saturating_sub(1).max(1)];
    inner.iter().copied().max_by(|&a, &b| above(a).total_cmp(&above(b))).unwrap_or(curve[curve.len() - 1])
}

#[cfg(test)]
mod tests {
    use super::super::sweep::tests::row;
    use super::*;

    fn rows() -> Vec<Row> {
        [(800, 52.05), (100, 30.0), (200, 41.0), (400, 46.0), (1600, 52.1), (300, 38.0)].map(|(b, db)| row(b, db, 0.1, 0.01)).to_vec()
    }

    fn picked(budget_bytes: Option<u64>, target_psnr_db: Option<f64>) -> Vec<(&'static str, u64, bool)> {
        let rows = rows();
        let picks = recommend(&rows, Goal { budget_bytes, target_psnr_db });
        picks.iter().map(|p| (p.name, rows[p.row].bytes, p.meets_goal)).collect()
    }

    #[test]
    fn a_budget_buys_the_best_picture_within() {
        assert_eq!(picked(Some(399), None), [("budget", 200, true)]);
        assert_eq!(picked(Some(1 << 20), None), [("budget", 800, true)], "0.05 dB are not worth 800 bytes");
        assert_eq!(picked(Some(99), None), [("budget", 100, false)], "nothing fits, the smallest");
    }

    #[test]
    fn a_target_is_reached_by_the_fewest_bytes() {
        assert_eq!(picked(None, Some(45.0)), [("target", 400, true)]);
        assert_eq!(picked(None, Some(52.1)), [("target", 1600, true)], "as it was asked for");
        assert_eq!(picked(None, Some(60.0)), [("target", 800, false)], "out of reach, the best");
        assert_eq!(picked(Some(400), Some(40.0)), [("target", 200, true)]);
        assert_eq!(picked(Some(300), Some(45.0)), [("target", 200, false)]);
    }

    #[test]
    fn without_a_goal_there_are_three() {
        // Above the chord from (100, 30) to (800, 52.05): 3.65 at 200, 1.3 at 400. Half of medium's error is out of reach below it.
        assert_eq!(picked(None, None), [("medium", 200, true), ("large", 800, true)]);
        let mut more = rows();
        more.push(row(150, 36.0, 0.1, 0.01));
        let names: Vec<_> = recommend(&more, Goal::default()).iter().map(|p| (p.name, more[p.row].bytes)).collect();
        assert_eq!(names, [("small", 150), ("medium", 200), ("large", 800)]);
        assert_eq!(recommend(&more[..1], Goal::default()).len(), 1, "one row is one recommendation");
        assert!(recommend(&[], Goal::default()).is_empty());
    }
}
