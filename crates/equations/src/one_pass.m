function metrics = one_pass(brushing_velocity, penetration_depth)
% One pass of a filament of @SEGMENTS@ segments over a plane workpiece.
%
%   metrics = one_pass(v_b, a_e) takes v_b in m/s and a_e in m; without them they are 20 m/s and 1 mm. The brush is that of Uhlmann
%   and Hoyer (Ceramics 2021), without friction.
%
%   metrics = one_pass('one/case.json') takes all settings from a file, which `bristle simulate FILE.toml --out one` writes. What this
%   function does not know, such as friction or an edge, is an error.
%
%   Without an output, the normal force is drawn. Runs in MATLAB (ode15s) and in GNU Octave from version 7 on (lsode), with the
%   functions of the equations in the same directory.

  if nargin > 0 && ischar(brushing_velocity)
    settings = read_settings(brushing_velocity);
  else
    settings = paper_settings();
    if nargin > 0
      settings.process.brushing_velocity_m_s = brushing_velocity;
    end
    if nargin > 1
      settings.process.penetration_depth_m = penetration_depth;
    end
  end
  brushing_velocity = settings.process.brushing_velocity_m_s;
  penetration_depth = settings.process.penetration_depth_m;
  body_radius = settings.tool.body_radius_m;
  filament_count = settings.tool.filament_count;
  filament_length = settings.filament.length_m;
  diameter = settings.filament.diameter_m;
  density = settings.filament.density_kg_m3;
  youngs_modulus = settings.filament.youngs_modulus_pa;
  damping_ratio = settings.filament.damping_ratio;
  lead_angle = settings.process.lead_angle_rad;
  tail_angle = settings.process.tail_angle_rad;

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
  tool.stiffness = settings.contact.stiffness_n_m;
  tool.gravity = settings.process.gravity_m_s2(1:@AXES@);
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
  arguments = {q, v, clamp.position, clamp.velocity, clamp.acceleration, clamp.direction, clamp.angular_velocity, tool.gravity(:), ...
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

function settings = paper_settings()
% In SI units, named as in input files.
  settings.tool = struct('body_radius_m', 0.140, 'filament_count', 10500);
  settings.filament = struct('length_m', 0.040, 'diameter_m', 1.18e-3, 'density_kg_m3', 1110, 'youngs_modulus_pa', 3.0e9, ...
    'damping_ratio', 0.05);
  settings.contact = struct('stiffness_n_m', 1e5);
  settings.process = struct('brushing_velocity_m_s', 20, 'penetration_depth_m', 1e-3, 'gravity_m_s2', [0; 0; 0], ...
    'lead_angle_rad', 0.005, 'tail_angle_rad', 0.15);
end

function settings = read_settings(name)
  settings = jsondecode(fileread(name));
  if isfield(settings, 'settings')
    settings = settings.settings;
  end
  if settings.filament.segments ~= @SEGMENTS@
    error('%s has %d segments, these equations have @SEGMENTS@: derive others', name, settings.filament.segments);
  end
  % Each has the value that this function assumes, if the file states it at all.
  assumed = {'tool', 'kind', 'round'; 'tool', 'tilt_rad', 0; 'tool', 'skew_rad', 0; 'tool', 'filament_angle_rad', pi/2; ...
    'filament', 'waviness_amplitude_m', 0; 'filament', 'tip_diameter_m', settings.filament.diameter_m; ...
    'filament', 'lateral_tilt_rad', 0; 'contact', 'exponent', 1; 'contact', 'damping_s_m', 0; 'contact', 'radius_m', 0; ...
    'contact', 'friction_coefficient', 0; 'workpiece', 'kind', 'plane'; 'workpiece', 'normal', [0; 1; 0]; 'process', 'turns', 1};
  for k = 1:size(assumed, 1)
    [section, key, value] = assumed{k, :};
    if isfield(settings.(section), key) && ~isequal(settings.(section).(key), value)
      error('%s: this function does not know %s.%s other than %s', name, section, key, mat2str(value));
    end
  end
  if isfield(settings, 'brush')
    error('%s: this function simulates one filament, without [brush]', name);
  end
end
