function metrics = one_pass(brushing_velocity, penetration_depth)
% One pass of a filament of @SEGMENTS@ segments over a plane workpiece.
%
%   metrics = one_pass(v_b, a_e) takes v_b in m/s and a_e in m; without them they are 20 m/s and 1 mm. Without an output, the
%   normal force is drawn. The brush is that of Uhlmann and Hoyer (Ceramics 2021), without friction; the settings below state it.
%
%   Runs in MATLAB (ode15s) and in GNU Octave (lsode), with the functions of the equations in the same directory.

  if nargin < 1
    brushing_velocity = 20;
  end
  if nargin < 2
    penetration_depth = 1e-3;
  end

  % Settings, in SI units.
  body_radius = 0.140;
  filament_count = 10500;
  filament_length = 0.040;
  diameter = 1.18e-3;
  density = 1110;
  youngs_modulus = 3.0e9;
  damping_ratio = 0.05;
  contact_stiffness = 1e5;
  lead_angle = 0.005;
  tail_angle = 0.15;

  % The chain: rigid segments of length h, joined by springs c and dampers d.
  n = @SEGMENTS@;
  area = pi * diameter^2 / 4;
  bending_stiffness = youngs_modulus * pi * diameter^4 / 64;
  h = filament_length / n;
  c = bending_stiffness / h * ones(n, 1);
  % The clamp joint carries half a segment's compliance.
  c(1) = 2 * c(1);
  first_frequency = 1.8751040687^2 * sqrt(bending_stiffness / (density * area * filament_length^4));
  chain.h = h;
  chain.m = density * area * h * ones(n, 1);
  chain.J = chain.m * h^2 / 12;
  chain.c = c;
  chain.d = 2 * damping_ratio / first_frequency * c;
  chain.kappa = zeros(n, 1);

  % The tool turns at a constant rate over the plane y = surface.
  radius = body_radius + filament_length;
  tool.body_radius = body_radius;
  tool.rate = brushing_velocity / radius;
  contact_angle = 2 * acos((radius - penetration_depth) / radius);
  tool.start_angle = -pi/2 - contact_angle/2 - lead_angle;
  tool.surface = -(radius - penetration_depth);
  tool.stiffness = contact_stiffness;
  duration = (lead_angle + contact_angle + tail_angle) / tool.rate;

  % At first the relaxed filament turns with the body. The last entry of the state is the impulse.
@START@
  times = linspace(0, duration, 2001)';
  longest_step = duration / 500;
  slope = @(t, y) state_slope(t, y, tool, chain);
  if exist('OCTAVE_VERSION', 'builtin')
    lsode_options('relative tolerance', 1e-7);
    lsode_options('absolute tolerance', 1e-10);
    lsode_options('maximum step size', longest_step);
    states = lsode(@(y, t) slope(t, y), start, times);
  else
    options = odeset('RelTol', 1e-7, 'AbsTol', 1e-10, 'MaxStep', longest_step);
    [~, states] = ode15s(slope, times, start, options);
  end

  force = zeros(size(times));
  for k = 1:numel(times)
    [~, force(k)] = contact(times(k), states(k, :)', tool, chain);
  end
  impulse = states(end, end);
  metrics.contact_normal_impulse_n_s = impulse;
  metrics.peak_contact_normal_force_n = max(force);
  metrics.tool_contact_normal_force_n = impulse * filament_count * tool.rate / (2*pi);
  % From the samples; it is as precise as they are close.
  metrics.contact_time_s = mean(force > 0) * duration;
  if nargout == 0
    plot(1e3 * times, force);
    xlabel('t in ms');
    ylabel('F_n in N');
    title(sprintf('v_b = %g m/s, a_e = %g mm: p_n = %.4g mN s', brushing_velocity, 1e3 * penetration_depth, 1e3 * impulse));
  end
end

function slope = state_slope(t, y, tool, chain)
  [q, v, clamp] = unpack(t, y, tool);
  [Q, normal_force] = contact(t, y, tool, chain);
  gravity = zeros(@AXES@, 1);
  arguments = {q, v, clamp.position, clamp.velocity, clamp.acceleration, clamp.direction, clamp.angular_velocity, gravity, ...
    chain.h, chain.m, chain.J, chain.c, chain.d, chain.kappa};
  accelerations = @PREFIX@mass_matrix(arguments{:}) \ (@PREFIX@force(arguments{:}) + Q);
  slope = [v; accelerations; normal_force];
end

function [q, v, clamp] = unpack(t, y, tool)
  size_of_q = (numel(y) - 1) / 2;
  q = y(1:size_of_q);
  v = y(size_of_q + 1:2 * size_of_q);
  beta = tool.start_angle + tool.rate * t;
@CLAMP@
  clamp.direction = radial;
  clamp.position = tool.body_radius * radial;
  clamp.velocity = tool.body_radius * tool.rate * across;
  clamp.acceleration = -tool.body_radius * tool.rate^2 * radial;
end

function [Q, normal_force] = contact(t, y, tool, chain)
% The generalised forces of the contact of all nodes with the plane, and its normal force.
  [q, ~, clamp] = unpack(t, y, tool);
@NODES@
  forces = tool.stiffness * max(0, tool.surface - heights);
  normal_force = sum(forces);
  % A coordinate moves the nodes of its own segment and those outside it.
  outer = flipud(cumsum(flipud(forces)));
@LOADS@
end
