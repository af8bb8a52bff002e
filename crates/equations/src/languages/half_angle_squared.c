
// Power series of S and its derivatives, lowest power first.
static const double SERIES[@ORDERS@][@TERMS@] = {
@ROWS@
};

// The derivative of order 0 to @MAX_ORDER@ of S(u) = acos(1 - u)^2 / 2, for u < 2.
static double half_angle_squared(int order, double u) {
    if (fabs(u) <= @LIMIT@) {
        double sum = 0.0;
        for (int k = @LAST@; k >= 0; k--) {
            sum = sum * u + SERIES[order][k];
        }
        return sum;
    }
    const double cosine = 1.0 - u;
    const double sine_squared = u * (2.0 - u);
    const double sine = sqrt(sine_squared);
    const double angle = atan2(sine, cosine);
    if (order == 0) {
        return 0.5 * angle * angle;
    }
    const double first = angle / sine;
    if (order == 1) {
        return first;
    }
    const double second = (1.0 - cosine * first) / sine_squared;
    return order == 2 ? second : (first - 3.0 * cosine * second) / sine_squared;
}
