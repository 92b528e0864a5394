function out = @name@(commands, t_end, every)
% @title@
%
% out = @name@(commands, t_end, every) simulates from rest at the origin. Each row of commands is a time (s) and the
% commands of the drives from then on; t_end (s) is the end, every (s) the interval of the rows. out.time, out.position
% (rad or m, a column for each of out.bodies), out.speed, out.current (A), out.events (time, element, what follows); of
% steppers, whose commands are positions in m, also out.second_current (A) and out.lost_steps.
%
%   out = @name@(@example@
%   plot(out.time, out.position)
%
% The linear model, everything sliding, is in @name@_data.mat: load('@name@_data.mat', 'A', 'B', 'C', 'D', 'states').
% Written by taut @version@. Runs in MATLAB and in GNU Octave; everything is in SI units.
%
% Between its events the machine is linear and a step is a product with a matrix exponential, or with steppers a Taylor
% series; where a condition of the mode falls below zero within a step, the instant is located by the step's series.

here = fileparts(mfilename('fullpath'));
m = load(fullfile(here, '@name@_data.mat'));
n = size(m.places, 1);
m.n = n;
drives = size(m.drives, 1);
m.input = n + size(m.products, 1);
% Products of states alone come before those of products.
m.early = find(all(m.products < n, 2));
m.late = find(any(m.products >= n, 2));
if nargin < 3
  every = m.step;
end
s.z = zeros(size(m.weights, 2), 1);
s.z(end) = 1;
s.told = zeros(size(m.steppers, 1), 1);
for k = 1:size(m.steppers, 1)
  % Currents that hold the rotor on its full step.
  sine = m.steppers(k, 2) + 1;
  s.z(sine:sine + 1) = [sin(pi / 4); cos(pi / 4)];
  s.z(sine - 2:sine - 1) = min(m.steppers(k, 8) * cos(pi / 4), m.steppers(k, 9));
end
s = turn_fields(m, s);
s.time = 0;
s.does = zeros(0, 1);
if ~isempty(m.elements)
  s.does = m.elements(:, 2);
end
s.events = zeros(0, 3);
s.cache = {};
s = take_up(m, s);

rows = round(t_end / every) + 1;
bodies = size(m.bodies, 1);
out.bodies = m.bodies;
out.time = (0:rows - 1)' * every;
out.position = zeros(rows, bodies);
out.speed = zeros(rows, bodies);
out.current = zeros(rows, drives);
out.second_current = zeros(rows, size(m.steppers, 1));
out.lost_steps = zeros(rows, size(m.steppers, 1));
next = 1;
for k = 1:rows
  while next <= size(commands, 1) && commands(next, 1) <= out.time(k) + 1e-9 * every
    s = advance(m, s, min(commands(next, 1), out.time(k)));
    s = settle(m, command(m, s, commands(next, 2:end)'));
    next = next + 1;
  end
  s = advance(m, s, out.time(k));
  out.position(k, :) = positions(m, s);
  out.speed(k, :) = s.z(m.body_places(:, 2) + 1);
  for drive = 1:drives
    out.current(k, drive) = row_of(m, s, m.outputs_first(1) + drive - 1) * s.z;
  end
  for drive = 1:size(m.steppers, 1)
    own = m.steppers(drive, :);
    out.second_current(k, drive) = row_of(m, s, m.others_first + drive - 1) * s.z;
    lag = s.told(drive) * own(4) - out.position(k, own(1) + 1);
    out.lost_steps(k, drive) = 4 * round(lag * own(3) / own(4) / (2 * pi));
  end
end
out.events = s.events;
end

% Takes up the commands of the drives; of steppers positions, rounded to microsteps.
function s = command(m, s, values)
if isempty(m.steppers)
  s.z(m.input + 1:end - 1) = values;
  return
end
for k = 1:size(m.steppers, 1)
  own = m.steppers(k, :);
  if own(5) > 0
    values(k) = round(values(k) / own(5)) * own(5);
  end
  if ~(abs(values(k) - s.told(k)) <= own(6))
    error('the command jumps by more than two full steps at %g s', s.time);
  end
  % Rounding leads sine and cosine away from the circle.
  sine = own(2) + 1;
  s.z(sine:sine + 1) = s.z(sine:sine + 1) / norm(s.z(sine:sine + 1));
end
s.told = values;
s = turn_fields(m, s);
end

% What the drivers of steppers command of their phases: the fields stand where they are told.
function s = turn_fields(m, s)
for k = 1:size(m.steppers, 1)
  angle = s.told(k) * m.steppers(k, 3) + pi / 4;
  s.z(m.input + 2 * k - 1:m.input + 2 * k) = m.steppers(k, 7) * [cos(angle); sin(angle)];
end
s.z = multiplied(m, s.z);
end

% z with its products.
function z = multiplied(m, z)
for k = [m.early; m.late]'
  z(m.n + k) = z(m.products(k, 1) + 1) * z(m.products(k, 2) + 1);
end
end

% The Taylor series of z over a step h, products by Cauchy's rule.
function terms = series(m, rates, z, h, order)
terms = zeros(numel(z), order + 1);
terms(:, 1) = z;
for k = 1:order
  terms(1:m.n, k + 1) = rates * terms(:, k) * (h / k);
  for group = {m.early, m.late}
    p = group{1};
    if ~isempty(p)
      one = terms(m.products(p, 1) + 1, 1:k + 1);
      other = terms(m.products(p, 2) + 1, k + 1:-1:1);
      terms(m.n + p, k + 1) = sum(one .* other, 2);
    end
  end
end
end

% The row of a table in the present mode.
function row = row_of(m, s, table)
row = row_in(m, s.does, table);
end

% The same in another mode.
function row = row_in(m, does, table)
index = 0;
for k = m.depends_first(table + 1) + 1:m.depends_first(table + 2)
  element = m.depends(k) + 1;
  index = index * m.elements(element, 1) + does(element);
end
row = m.weights(m.entry(m.entry_first(table + 1) + index + 1) + 1, :);
end

% Takes the equations of the mode, z' = a z but for products, and the conditions under which they hold; those of known modes are kept.
function s = take_up(m, s)
key = char(s.does' + 'a');
for k = 1:numel(s.cache)
  if strcmp(s.cache{k}.key, key)
    s.mode = s.cache{k};
    return
  end
end
mode.key = key;
mode.a = zeros(size(m.weights, 2));
for place = 1:m.n
  mode.a(place, :) = row_of(m, s, place - 1);
end
mode.guards = [];
mode.rows = zeros(0, size(m.weights, 2));
for k = 1:size(m.guards, 1)
  element = m.guards(k, 2) + 1;
  if element == 0 || s.does(element) == m.guards(k, 3)
    mode.guards(end + 1) = k;
    mode.rows(end + 1, :) = row_of(m, s, m.guards(k, 1));
  end
end
mode.h = 0.25 / m.fastest;
if isempty(m.products)
  mode.p = expm(mode.a * mode.h);
else
  mode.h = 0.8 / m.fastest;
end
s.cache{end + 1} = mode;
s.mode = mode;
end

% Whether a condition falls below zero here: the first of its derivatives that is more than rounding decides.
function answer = falls(row, values, sizes)
answer = false;
for k = 1:size(values, 2)
  now = row * values(:, k);
  if abs(now) > 1e-13 * (abs(row) * sizes(:, k))
    answer = now < 0;
    return
  end
end
end

% What follows a condition: as its column says, or as the breakaway says that the load on a body at rest passes.
function to = decided(m, s, guard)
to = m.guards(guard, 4);
does = s.does;
for k = 1:size(m.resting, 1)
  does(m.resting(k, 1) + 1) = row_of(m, s, m.resting(k, 2)) * s.z < 0;
end
for breakaway = m.guards(guard, 6:7) + 1
  if breakaway > 0
    row = row_in(m, does, m.guards(breakaway, 1));
    if row * s.z < -1e-13 * (abs(row) * abs(s.z))
      to = m.guards(breakaway, 4);
      return
    end
  end
end
end

% Does what follows where a condition falls.
function s = change(m, s, guard)
for k = 1:size(m.resets, 1)
  if m.resets(k, 1) + 1 == guard
    s.z(m.resets(k, 2) + 1) = m.reset_values(k);
  end
end
s.z = multiplied(m, s.z);
element = m.guards(guard, 2) + 1;
to = decided(m, s, guard);
s.events(end + 1, :) = [s.time, element - 1, to];
if to == @leave@
  error('something left its travel at %g s', s.time);
end
s.does(element) = to;
s = take_up(m, s);
end

% Changes modes, without time passing, until every condition holds.
function s = settle(m, s)
for turn = 1:100
  fallen = 0;
  rates = s.mode.a(1:m.n, :);
  values = series(m, rates, s.z, 1 / m.fastest, 23);
  sizes = series(m, abs(rates), abs(s.z), 1 / m.fastest, 23);
  for k = 1:numel(s.mode.guards)
    guard = s.mode.guards(k);
    if (fallen == 0 || m.guards(guard, 5) < m.guards(fallen, 5)) && falls(s.mode.rows(k, :), values, sizes)
      fallen = guard;
    end
  end
  if fallen == 0
    return
  end
  s = change(m, s, fallen);
end
error('too many events at %g s', s.time);
end

% Goes on to a time.
function s = advance(m, s, goal)
while goal - s.time > 1e-15 * max(1, goal)
  h = min(s.mode.h, goal - s.time);
  if ~isempty(m.products)
    terms = series(m, s.mode.a(1:m.n, :), s.z, h, 20);
    after = multiplied(m, sum(terms, 2));
  elseif h == s.mode.h
    after = s.mode.p * s.z;
  else
    after = expm(s.mode.a * h) * s.z;
  end
  below = find(s.mode.rows * after < 0);
  if isempty(below)
    s.z = after;
    s.time = s.time + h;
    continue
  end
  % The Taylor series of z over the step, and of each condition that falls in it.
  terms = series(m, s.mode.a(1:m.n, :), s.z, h, 20);
  earliest = 2;
  fallen = 0;
  for k = below'
    c = fliplr(s.mode.rows(k, :) * terms);
    low = 0;
    high = 1;
    for turn = 1:60
      middle = 0.5 * (low + high);
      if polyval(c, middle) < 0
        high = middle;
      else
        low = middle;
      end
    end
    guard = s.mode.guards(k);
    if high < earliest || (high == earliest && m.guards(guard, 5) < m.guards(fallen, 5))
      earliest = high;
      fallen = guard;
    end
  end
  s.z = multiplied(m, terms * (earliest .^ (0:20)'));
  s.time = s.time + earliest * h;
  s = settle(m, change(m, s, fallen));
end
end

% Ways of the bodies: lengths of the belt stand in the places of some angles.
function ways = positions(m, s)
ways = s.z(m.body_places(:, 1) + 1)';
k = 1;
while k <= size(m.lengths, 1)
  body = m.lengths(k, 1) + 1;
  arm = m.lengths(k, 3);
  length_ = ways(body);
  k = k + 1;
  while k <= size(m.lengths, 1) && m.lengths(k, 2) >= 0
    length_ = length_ - m.lengths(k, 3) * ways(m.lengths(k, 2) + 1);
    k = k + 1;
  end
  ways(body) = length_ / arm;
end
end
