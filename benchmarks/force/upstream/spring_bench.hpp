// A spring that an arm presses, with a delay, for any controller that is called once a tick.
//
// Written for this benchmark; it knows nothing of palpate. Tasks come one a line on standard input, each with the
// numbers of the controller after those of the bench, and one number a line goes out.
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

// A controller's tick: measured position [m] and force on the tool [N] in; position [m] or velocity [m/s] out. With a
// mass [kg], the arm is driven by forces: measured position and velocity in; force [N] out.
struct Tick
{
  std::function<double(double, double)> call;
  double mass = 0.0;
  double smallest = 0.0, largest = 1e12;  // displacements [m] between which the controller is linear
};

struct Bench
{
  double rate, delay;
  bool velocity;  // what the controller commands
  bool sensor;    // the arm follows at once, and the force alone is late
};

// Move a mass on a spring under a constant force, exactly.
inline void move(double mass, double stiffness, double force, double time, double & x, double & v)
{
  const double w = std::sqrt(stiffness / mass), rest = force / stiffness, c = std::cos(w * time), s = std::sin(w * time);
  const double away = x - rest, speed = v;
  x = rest + away * c + speed / w * s;
  v = speed * c - away * w * s;
}

// Positions at the ticks while an arm driven by forces presses a spring.
inline void run_forces(
  const Bench & bench, const Tick & tick, double stiffness, long ticks, const std::function<double(long)> & push,
  const std::function<bool(long, double)> & see)
{
  const double late = bench.delay * bench.rate;
  const long whole = static_cast<long>(std::floor(late + 1e-9));
  const double part = std::max(0.0, late - double(whole));
  std::vector<double> commands;
  auto command = [&](long k) { return k < 0 ? 0.0 : commands[static_cast<size_t>(k)]; };
  double x = 0.0, v = 0.0;
  for (long k = 0; k < ticks && see(k, x); ++k) {
    commands.push_back(tick.call(x, v));
    move(tick.mass, stiffness, command(k - 1 - whole) + push(k), part / bench.rate, x, v);
    move(tick.mass, stiffness, command(k - whole) + push(k), (1.0 - part) / bench.rate, x, v);
  }
}

// Positions at the ticks while the tool presses a spring, the force being pushed by u(k) newton.
inline void run(
  const Bench & bench, const Tick & tick, double stiffness, long ticks, const std::function<double(long)> & push,
  const std::function<bool(long, double)> & see)
{
  if (tick.mass > 0.0) return run_forces(bench, tick, stiffness, ticks, push, see);
  const double late = bench.delay * bench.rate;
  std::vector<double> commands, places;
  double x = 0.0;
  auto command = [&](long k) { return k < 0 ? 0.0 : commands[static_cast<size_t>(k)]; };
  // Index of the newest command that has arrived before the time of tick t: it was given just after tick k.
  auto newest = [&](double t, double wait) { return static_cast<long>(std::ceil(t - wait - 1e-9)) - 1; };
  for (long k = 0; k < ticks; ++k) {
    if (!bench.velocity) {
      x = command(newest(double(k), bench.sensor ? 0.0 : late));
    } else if (k > 0) {
      const long whole = static_cast<long>(std::floor(late + 1e-9));
      const double part = std::max(0.0, late - double(whole));
      x += ((1.0 - part) * command(k - 1 - whole) + part * command(k - 2 - whole)) / bench.rate;
    }
    places.push_back(x);
    const long seen = bench.sensor ? newest(double(k), late) + 1 : k;
    const double pressed = seen < 0 ? 0.0 : places[static_cast<size_t>(seen)];
    if (!see(k, pressed)) return;
    commands.push_back(tick.call(x, push(k) - stiffness * pressed));
  }
}

// A push [N] in the first tick that moves the tip by a tenth of the range in which the controller is linear.
inline double first_push(const Bench & bench, const std::function<Tick()> & make, double stiffness)
{
  const Tick tick = make();
  if (tick.smallest == 0.0) return 1.0;
  double push = 1.0, peak = 0.0;
  for (int i = 0; i < 2; ++i, push *= 0.1 * tick.largest / peak) {
    peak = 0.0;
    run(bench, make(), stiffness, 100 + std::lround(bench.delay * bench.rate), [&](long k) { return k ? 0.0 : push; },
      [&](long, double x) { return (peak = std::max(peak, std::abs(x))) < 1e12; });
  }
  return push;
}

// True if the second differences of the position grow from the third quarter of the run to the last. A motion that
// leaves the range in which the controller is linear upwards grows, and one that dies out into a dead band does not.
inline bool grows(const Bench & bench, const std::function<Tick()> & make, double stiffness, long ticks)
{
  double earlier = 0.0, later = 0.0, first = 0.0, second = 0.0, peak = 0.0;
  bool far = false, dead = false;
  const Tick tick = make();
  const double push = first_push(bench, make, stiffness);
  run(bench, tick, stiffness, ticks, [&](long k) { return k == 0 ? push : 0.0; }, [&](long k, double x) {
    const double bend = std::abs(x - 2.0 * first + second);
    second = first;
    first = x;
    if (k >= ticks / 2) (k < 3 * ticks / 4 ? earlier : later) = std::max(k < 3 * ticks / 4 ? earlier : later, bend);
    peak = std::max(peak, std::abs(x));
    if (k % (ticks / 10) == ticks / 10 - 1) {
      dead = peak < 100.0 * tick.smallest;  // from there on a dead band is more than a percent of the motion
      peak = 0.0;
    }
    far = !(std::abs(x) < tick.largest);
    return !far && !dead;
  });
  return far || (!dead && later > earlier);
}

// Softest stiffness at which the loop grows; infinite if none does.
inline double edge(const Bench & bench, const std::function<Tick()> & make, double low, double high, long ticks)
{
  double stable = low;
  if (grows(bench, make, low, ticks)) return low;
  for (double K = low * 1.5;; K *= 1.5) {
    if (K > high) return std::numeric_limits<double>::infinity();
    if (grows(bench, make, K, ticks)) {
      for (double unstable = K; unstable > 1.002 * stable;) {
        const double middle = std::sqrt(stable * unstable);
        (grows(bench, make, middle, ticks) ? unstable : stable) = middle;
      }
      return stable;
    }
    stable = K;
  }
}

// Overshoot of the force after a step, relative to the force at the end; or the change over the run's second half.
inline double step(
  const Bench & bench, const std::function<Tick()> & make, double stiffness, long ticks, bool overshoot)
{
  double peak = 0.0, middle = 0.0, last = 0.0;
  const Tick tick = make();
  const double push = tick.smallest > 0.0 ? 0.03 * stiffness * tick.largest : 1.0;
  run(bench, tick, stiffness, ticks, [&](long) { return push; }, [&](long k, double x) {
    peak = std::max(peak, x);
    last = x;
    if (k == ticks / 2) middle = x;
    return std::abs(x) < 1e12;
  });
  if (!(std::abs(last) < 1e12)) return std::numeric_limits<double>::infinity();
  return overshoot ? peak / last - 1.0 : std::abs(1.0 - middle / last);
}

// Answer the tasks: edge LOW HIGH TICKS | grows, overshoot or unsettled K TICKS, then RATE DELAY VELOCITY SENSOR NUMBERS.
inline int serve(const std::function<std::function<Tick()>(double rate, bool velocity, std::istream &)> & read)
{
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream in(line);
    std::string task;
    double a = 0.0, b = 0.0;
    long ticks = 0;
    Bench bench{};
    in >> task >> a;
    if (task == "edge") in >> b;
    double velocity = 0.0, sensor = 0.0;
    in >> ticks >> bench.rate >> bench.delay >> velocity >> sensor;
    bench.velocity = velocity > 0.5;
    bench.sensor = sensor > 0.5;
    const auto make = read(bench.rate, bench.velocity, in);
    std::cout.precision(9);
    if (task == "edge") std::cout << edge(bench, make, a, b, ticks) << std::endl;
    else if (task == "grows") std::cout << grows(bench, make, a, ticks) << std::endl;
    else std::cout << step(bench, make, a, ticks, task == "overshoot") << std::endl;
  }
  return 0;
}
