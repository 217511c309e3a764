//! Pointwise errors.

/// The epsilon of the relative MSE: `(a - b)^2 / (b^2 + EPSILON)`.
pub const EPSILON: f64 = 0.01;

/// Pointwise errors over all pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Mean of the squared difference over the squared reference plus [`EPSILON`].
    pub rel_mse: f64,
    /// Largest absolute difference.
    pub max: f64,
}

/// Compares `test` with `reference` value by value, in `f64`. Equal values differ by 0, infinities and NaN of both
/// sides included; where only one side is not finite, every metric is infinite.
pub fn errors(test: &[[f32; 3]], reference: &[[f32; 3]]) -> Errors {
    let (mut squares, mut relative, mut max) = (0.0f64, 0.0f64, 0.0f64);
    for (&a, &b) in test.as_flattened().iter().zip(reference.as_flattened()) {
        let same = a == b || (a.is_nan() && b.is_nan());
        let difference = if same { 0.0 } else { (f64::from(a) - f64::from(b)).abs() };
        let difference = if difference.is_nan() { f64::INFINITY } else { difference };
        let square = difference * difference;
        squares += square;
        if difference > 0.0 {
            relative += if difference.is_finite() { square / (f64::from(b) * f64::from(b) + EPSILON) } else { square };
        }
        max = max.max(difference);
    }
    let count = (test.len() * 3).max(1) as f64;
    Errors { rmse: (squares / count).sqrt(), rel_mse: relative / count, max }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_computed_by_hand() {
        let a = [[1.0, 0.0, 0.0], [0.0; 3]];
        let b = [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]];
        let e = errors(&a, &b);
        assert!((e.rmse - (5.0f64 / 6.0).sqrt()).abs() < 1e-12);
        assert!((e.rel_mse - (1.0 / 0.01 + 4.0 / 4.01) / 6.0).abs() < 1e-12);
        assert_eq!(e.max, 2.0);
    }

    #[test]
    fn values_that_are_not_finite_are_equal_to_themselves_only() {
        let odd = [[f32::NAN, f32::INFINITY, f32::NEG_INFINITY]];
        assert_eq!(errors(&odd, &odd), Errors { rmse: 0.0, rel_mse: 0.0, max: 0.0 });
        assert_eq!(errors(&odd, &[[0.0; 3]]).max, f64::INFINITY);
        assert_eq!(errors(&[[0.0; 3]], &odd).rmse, f64::INFINITY);
    }
}
