
/// The derivative of order 0 to @MAX_ORDER@ of `S(u) = acos(1 - u)^2 / 2`, for `u < 2`.
#[allow(dead_code)]
fn half_angle_squared(order: u8, u: f64) -> f64 {
    /// Power series of `S` and its derivatives, lowest power first.
    const SERIES: [[f64; @TERMS@]; @ORDERS@] = [
@ROWS@,
    ];
    if u.abs() <= @LIMIT@ {
        let series = SERIES[usize::from(order)].iter().rev();
        return series.fold(0.0, |sum, coefficient| sum * u + coefficient);
    }
    let cosine = 1.0 - u;
    let sine_squared = u * (2.0 - u);
    let sine = sine_squared.sqrt();
    let angle = sine.atan2(cosine);
    if order == 0 {
        return 0.5 * angle * angle;
    }
    let first = angle / sine;
    if order == 1 {
        return first;
    }
    let second = (1.0 - cosine * first) / sine_squared;
    if order == 2 { second } else { (first - 3.0 * cosine * second) / sine_squared }
}
