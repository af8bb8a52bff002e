function value = half_angle_squared(order, u)
% The derivative of order 0 to @MAX_ORDER@ of S(u) = acos(1 - u)^2 / 2, for u < 2.

  % Power series of S and its derivatives, lowest power first.
  persistent SERIES
  if isempty(SERIES)
    SERIES = [ ...
@ROWS@];
  end
  if abs(u) <= @LIMIT@
    value = polyval(fliplr(SERIES(order + 1, :)), u);
    return
  end
  cosine = 1 - u;
  sine_squared = u * (2 - u);
  sine = sqrt(sine_squared);
  angle = atan2(sine, cosine);
  first = angle / sine;
  second = (1 - cosine * first) / sine_squared;
  values = [0.5 * angle^2, first, second, (first - 3 * cosine * second) / sine_squared];
  value = values(order + 1);
end
