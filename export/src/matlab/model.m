function out = @name@(commands, t_end, every)
% @title@
%
% out = @name@(commands, t_end, every) simulates from rest at the origin. Each row of commands is a time (s) and the
% commands of the drives from then on; t_end (s) is the end, every (s) the interval of the rows. out.time, out.position
% (rad or m, a column for each of out.bodies), out.speed, out.current (A), out.events (time, element, what follows).
%
%   out = @name@([0 5; 0.25 0], 1, 1e-3);      % 5 V for 0.25 s
%   plot(out.time, out.position)
%
% The linear model, everything sliding, is in @name@_data.mat: load('@name@_data.mat', 'A', 'B', 'C', 'D', 'states').
% Written by taut @version@. Runs in MATLAB and in GNU Octave; everything is in SI units.
%
% Between its events the machine is linear and a step is a product with a matrix exponential; where a condition of the
% mode falls below zero within a step, the instant is located by the step's Taylor series.

here = fileparts(mfilename('fullpath'));
m = load(fullfile(here, '@name@_data.mat'));
n = size(m.places, 1);
m.n = n;
drives = size(m.drives, 1);
size_z = n + drives + 1;
if nargin < 3
  every = m.step;
end
s.z = [zeros(n + drives, 1); 1];
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
next = 1;
for k = 1:rows
  while next <= size(commands, 1) && commands(next, 1) <= out.time(k) + 1e-9 * every
    s = advance(m, s, min(commands(next, 1), out.time(k)));
    s.z(n + 1:n + drives) = commands(next, 2:end)';
    s = settle(m, s);
    next = next + 1;
  end
  s = advance(m, s, out.time(k));
  out.position(k, :) = positions(m, s);
  out.speed(k, :) = s.z(m.body_places(:, 2) + 1);
  for drive = 1:drives
    out.current(k, drive) = row_of(m, s, m.outputs_first(1) + drive - 1) * s.z;
  end
end
out.events = s.events;
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

% Takes the equations of the mode, z' = a z, and the conditions under which they hold; those of known modes are kept.
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
mode.p = expm(mode.a * mode.h);
s.cache{end + 1} = mode;
s.mode = mode;
end

% Whether a condition falls below zero here: the first of its derivatives that is more than rounding decides.
function answer = falls(s, row)
value = s.z;
sizes = abs(value);
answer = false;
for k = 1:24
  now = row * value;
  if abs(now) > 1e-13 * (abs(row) * sizes)
    answer = now < 0;
    return
  end
  value = s.mode.a * value;
  sizes = abs(s.mode.a) * sizes;
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
  for k = 1:numel(s.mode.guards)
    guard = s.mode.guards(k);
    if (fallen == 0 || m.guards(guard, 5) < m.guards(fallen, 5)) && falls(s, s.mode.rows(k, :))
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
  if h == s.mode.h
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
  terms = s.z;
  for k = 1:20
    terms(:, k + 1) = s.mode.a * terms(:, k) * (h / k);
  end
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
  s.z = terms * (earliest .^ (0:20)');
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
