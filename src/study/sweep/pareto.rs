//! Pareto set, and an evenly distributed selection of it.

/// Returns the indices of the Pareto-optimal points, in the order of the first cost.
///
/// Point a dominates point b if no cost of a is higher and at least one is lower. Of equal points, one is returned.
pub fn pareto_set(costs: &[Vec<f64>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..costs.len()).collect();
    // In lexicographic order, a point can be dominated only by earlier points.
    order.sort_by(|a, b| {
        let pairs = costs[*a].iter().zip(&costs[*b]);
        pairs.map(|(x, y)| x.total_cmp(y)).find(|o| o.is_ne()).unwrap_or(a.cmp(b))
    });
    let mut front: Vec<usize> = Vec::new();
    for index in order {
        let dominates = |other: &usize| costs[*other].iter().zip(&costs[index]).all(|(a, b)| a <= b);
        if !front.iter().any(dominates) {
            front.push(index);
        }
    }
    front
}

/// Selects at most `count` evenly distributed points; returns their indices in ascending order.
///
/// The selection starts with the best point of each goal, then adds the point most distant from the selected ones.
/// Costs are scaled by their ranges.
pub fn spread(points: &[Vec<f64>], count: usize) -> Vec<usize> {
    if points.len() <= count {
        return (0..points.len()).collect();
    }
    let goals = points.first().map_or(0, Vec::len);
    let range = |k: usize| {
        let values = points.iter().map(|p| p[k]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        f64::max(high - low, f64::MIN_POSITIVE)
    };
    let ranges: Vec<f64> = (0..goals).map(range).collect();
    let distance2 =
        |a: usize, b: usize| -> f64 { (0..goals).map(|k| ((points[a][k] - points[b][k]) / ranges[k]).powi(2)).sum() };
    let mut chosen: Vec<usize> = Vec::new();
    for k in 0..goals {
        let best = (0..points.len()).min_by(|a, b| points[*a][k].total_cmp(&points[*b][k]));
        chosen.extend(best.filter(|best| !chosen.contains(best) && chosen.len() < count));
    }
    let mut nearest: Vec<f64> =
        (0..points.len()).map(|p| chosen.iter().map(|c| distance2(p, *c)).fold(f64::INFINITY, f64::min)).collect();
    while chosen.len() < count {
        let Some(next) = (0..points.len()).max_by(|a, b| nearest[*a].total_cmp(&nearest[*b])) else { break };
        chosen.push(next);
        for (p, distance) in nearest.iter_mut().enumerate() {
            *distance = distance.min(distance2(p, next));
        }
    }
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dominated_and_duplicate_points_are_excluded() {
        let costs = [[1.0, 3.0], [2.0, 2.0], [2.0, 2.0], [3.0, 2.5], [3.0, 1.0], [0.5, 9.0]].map(|c| c.to_vec());
        assert_eq!(pareto_set(&costs), [5, 0, 1, 4]);
        assert!(pareto_set(&[]).is_empty());
    }

    #[test]
    fn a_spread_has_both_ends_and_equal_gaps() {
        let line: Vec<Vec<f64>> = (0..=100).map(|k| vec![f64::from(k), 100.0 - f64::from(k)]).collect();
        assert_eq!(spread(&line, 5), [0, 25, 50, 75, 100]);
        assert_eq!(spread(&line[..3], 5), [0, 1, 2]);
    }
}
