//! The settings that no other beats.

use super::Row;

/// Times within this factor count as equal: what one machine measures twice differs by as much.
const TIME_NOISE: f64 = 1.2;

/// Whether `a` is nowhere worse than `b` (times within their noise) and better in what can be measured without noise. Rows that are
/// equal in all of that are one octree, and the first stands for it.
fn beats((i, a): (usize, &Row), (j, b): (usize, &Row)) -> bool {
    let exact = |row: &Row| [row.bytes as f64, -row.psnr_db, row.rmse_rel];
    let (of_a, of_b) = (exact(a), exact(b));
    if of_a == of_b {
        return i < j;
    }
    let times = a.build_s <= b.build_s * TIME_NOISE && a.frame_s <= b.frame_s * TIME_NOISE;
    times && of_a.iter().zip(&of_b).all(|(a, b)| a <= b)
}

/// The rows that no other beats on all of bytes, picture, field error, build time and frame time: the Pareto front, as indices from the
/// smallest octree to the largest.
pub fn front(rows: &[Row]) -> Vec<usize> {
    let unbeaten = |j: usize| !rows.iter().enumerate().any(|(i, row)| i != j && beats((i, row), (j, &rows[j])));
    by_bytes(rows, (0..rows.len()).filter(|&j| unbeaten(j)).collect())
}

/// The rows that are better in the picture than every row that costs no more, as indices by rising cost: the front of two of the counts,
/// the line in a chart.
pub fn picture_front(rows: &[Row], cost: impl Fn(&Row) -> f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|&a, &b| cost(&rows[a]).total_cmp(&cost(&rows[b])).then(rows[b].psnr_db.total_cmp(&rows[a].psnr_db)));
    let mut best = f64::NEG_INFINITY;
    order.retain(|&i| {
        let better = rows[i].psnr_db > best;
        best = best.max(rows[i].psnr_db);
        better
    });
    order
}

fn by_bytes(rows: &[Row], mut indices: Vec<usize>) -> Vec<usize> {
    indices.sort_by_key(|&i| rows[i].bytes);
    indices
}

#[cfg(test)]
mod tests {
    use super::super::sweep::tests::row;
    use super::*;

    #[test]
    fn only_what_is_beaten_on_all_counts_is_off_the_front() {
        let rows = [
            row(300, 50.0, 0.3, 0.03),
            row(100, 40.0, 0.1, 0.01),
            row(200, 39.0, 0.2, 0.02),   // larger, worse and slower than the one before
            row(250, 39.0, 0.2, 0.001),  // worse too, but the fastest to draw
            row(400, 50.0, 0.3, 0.03),   // larger than the first for nothing
            row(150, 40.5, 0.05, 0.012), // larger than the second, but better
        ];
        assert_eq!(front(&rows), [1, 5, 3, 0]);
        assert_eq!(picture_front(&rows, |r| r.bytes as f64), [1, 5, 0]);
        assert_eq!(picture_front(&rows, |r| r.frame_s), [3, 1, 5, 0]);
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn noise_of_times_saves_no_row() {
        let rows = [row(100, 40.0, 0.100, 0.010), row(120, 39.0, 0.095, 0.0099), row(121, 39.0, 0.05, 0.0099)];
        assert_eq!(front(&rows), [0, 2], "5 % are noise, half the time is not");
        let equal = [row(100, 40.0, 0.1, 0.01), row(100, 40.0, 0.01, 0.01)];
        assert_eq!(front(&equal), [0], "of equal ones the first");
    }

    #[test]
    fn a_smaller_field_error_is_a_reason_to_stay() {
        let mut rows = vec![row(100, 40.0, 0.1, 0.01), row(120, 39.0, 0.1, 0.01)];
        rows[1].rmse_rel = rows[0].rmse_rel / 2.0;
        assert_eq!(front(&rows), [0, 1]);
    }
}
