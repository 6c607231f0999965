/* One tick of the bench by hand: sense, think, act, move, and write the row. For measuring against, not for use.
 *
 * The same arithmetic as palpate.bench.tick with a Kelvin-Voigt surface and the neural controller of 9-12-3.
 */
#include <stdlib.h>

#include "arm.h"
#include "network.h"
#include "plant.h"
#include "squares.h"

enum { APPROACH, CONTACT, LOST };

typedef struct { int phase; double ticks, since, x_d, x0; } sequence_state;
typedef struct {
    v3 q, x;
    double velocity;
    memory angle, rate;
    memory3 twist;
    memory acceleration, force;
} conditioning_state;
typedef struct {
    v3 q, qd, x, xd;
    double f, velocity, acceleration, smooth_acceleration, sampled;
} signals_t;

typedef struct {
    numbers n;
    double sensor_code, input_code;
    v3 output_code;
    plant_state plant;
    touch_t felt;
    sensor_state sensor;
    conditioning_state conditioning;
    sequence_state sequence;
    network net;
    v3 x_before, command;
    squares_state thesis, raw, matched;
    front_state front;
    centring_state centring;
    int listening;
} bench;

static const double TURN = 6.283185307179586;

static double encoded(double angle, double counts, double offset) {
    return whole((angle - offset) * counts / TURN) * TURN / counts + offset;
}
static v3 encoded3(const numbers *n, v3 q) {
    return vec(encoded(q.x, n->counts.x, n->offset.x), encoded(q.y, n->counts.y, n->offset.y),
               encoded(q.z, n->counts.z, n->offset.z));
}

/* Numbers in the order of `numbers`, weights in that of the network; at rest in the air. */
bench *bench_new(const double *values, const double *weights) {
    bench *b = calloc(1, sizeof *b);
    if (!b) return NULL;
    numbers *n = &b->n;
    memcpy(n, values, sizeof *n);
    b->sensor_code = resolution(n->sensor.full_scale, n->sensor.bits);
    b->input_code = resolution(n->input.full_scale, n->input.bits);
    b->output_code = over(n->output.full_scale, exp2(n->output.bits - 1.0));
    v3 q = encoded3(n, n->q);
    b->plant.q = n->q;
    b->felt.penetration = pose_of(&n->arm, directions_of(n->q), n->q).x - n->wall;
    b->conditioning.q = q;
    b->conditioning.x = pose_of(&n->model, directions_of(q), q);
    b->conditioning.angle = at_rest(&n->motion, q.z);
    b->sequence.x_d = b->sequence.x0 = n->approach_start;
    memcpy(b->net.hidden, weights, sizeof b->net.hidden);
    memcpy(b->net.output, weights + HIDDEN * (INPUTS + 1), sizeof b->net.output);
    b->thesis = squares_start(&n->thesis);
    b->raw = squares_start(&n->raw);
    b->matched = squares_start(&n->matched);
    double x = b->conditioning.x.x;
    b->front.second = at_rest(&n->front2, x);
    b->front.first = at_rest(&n->front1, x);
    for (int i = 0; i < 10; i++) b->front.history[i] = x;
    b->front.position.i2 = x;
    return b;
}
void bench_free(bench *b) { free(b); }
unsigned long bench_numbers(void) { return sizeof(numbers) / sizeof(double); }

INLINE signals_t condition(const numbers *n, conditioning_state *s, v3 q, double force) {
    signals_t out;
    double q3 = filter(&n->motion, &s->angle, q.z), tick = n->conditioning_tick;
    v3 qd = over(sub(q, s->q), tick);
    out.q = vec(q.x, q.y, q3);
    out.qd = vec(qd.x, qd.y, filter(&n->motion, &s->rate, qd.z));
    out.x = pose_of(&n->model, directions_of(out.q), out.q);
    v3 xd = over(sub(out.x, s->x), tick);
    out.xd = filter3(&n->motion, &s->twist, xd);
    out.velocity = xd.x;
    out.acceleration = (xd.x - s->velocity) / tick;
    out.smooth_acceleration = filter(&n->motion, &s->acceleration, out.acceleration);
    out.sampled = force;
    out.f = filter(&n->smooth, &s->force, force);
    s->q = q;
    s->x = out.x;
    s->velocity = xd.x;
    return out;
}
INLINE void sequence_step(const numbers *n, sequence_state *s, double x, double force) {
    s->ticks += 1.0;
    s->since = s->ticks * n->sequence_tick;
    if (s->phase == CONTACT) {
        if (force < n->release) {
            s->phase = LOST;
            s->ticks = s->since = 0.0;
        }
        return;
    }
    if (force >= n->switch_at) {
        s->phase = CONTACT;
        s->ticks = s->since = 0.0;
        s->x0 = x;
        return;
    }
    if (s->phase == LOST) {
        if (s->since < n->wait) return;
        s->ticks = n->hold / n->sequence_tick;
        s->since = n->hold;
    }
    s->phase = APPROACH;
    double late = s->since - n->hold + 5e-7;
    s->x_d = late < 0.0 ? n->approach_start : n->first + n->step * floor(late / n->period);
}
INLINE void estimate(bench *b, const signals_t *s) {
    const numbers *n = &b->n;
    int pressing = b->sequence.phase == CONTACT;
    double x = s->x.x, y = s->sampled;
    if (pressing) {
        squares_step(&n->thesis, &b->thesis, vec(s->smooth_acceleration, s->velocity, x - b->sequence.x0), s->f);
        squares_step(&n->raw, &b->raw, vec(s->acceleration, s->velocity, x - b->sequence.x0), s->sampled);
    }
    v3 phi = front_step(n, &b->front, x, &y);
    if (!b->listening && (pressing || s->f > n->touch)) {
        b->listening = 1;
        b->matched = squares_start(&n->matched);
        memset(&b->centring, 0, sizeof b->centring);
    } else if (!pressing && s->f < 0.0) {
        b->listening = 0;
    }
    if (b->listening) {
        phi = centre(n->centring, &b->centring, phi, &y);
        squares_step(&n->matched, &b->matched, phi, y);
    }
}
INLINE double desired_force(const numbers *n, double since) {
    double level = fmod(floor((since + 5e-7) / n->force_period), 2.0) == 0.0 ? n->force_first : n->force_second;
    double clock = n->restart <= 0.0 ? since : since - n->restart * floor((since + 5e-7) / n->restart);
    return level + n->amplitude * sin(TURN * n->frequency * clock);
}
INLINE v3 position_torque(v3 kp, v3 kv, const signals_t *s, v3 at, v3 free, const arm_model *m) {
    v3 u = mul(free, add(mul(kv, scale(-1.0, s->xd)), mul(kp, sub(at, s->x))));
    return add(times(m->M, solved(solver_of(m->J), sub(u, m->Jdqd))), m->h);
}
INLINE v3 press(bench *b, const signals_t *s, v3 at, double desired, const arm_model *m) {
    const numbers *n = &b->n;
    double lacking = desired - s->f;
    v3 torque = add(position_torque(n->kp, n->kv, s, at, vec(0.0, 1.0, 1.0), m),
                    scale(desired + n->kf.x * lacking, m->J.r1));
    v3 x = add(s->x, n->pose_offset), before = add(b->x_before, n->pose_offset);
    const double in[INPUTS] = {x.x, x.y, x.z, before.x, before.y, before.z, torque.x, torque.y, torque.z};
    const double error[OUTPUTS] = {lacking, at.y - s->x.y, at.z - s->x.z};
    memcpy(b->net.in, in, sizeof in);
    forward(&b->net);
    b->command = mul(n->outputs, vec(b->net.out[0], b->net.out[1], b->net.out[2]));
    learn(&b->net, error, &n->outputs.x, n->learning_rate);
    b->x_before = s->x;
    return add(torque, transposed_times(m->J, b->command));
}
INLINE double *put(double *out, v3 v) {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
    return out + 3;
}
INLINE double beyond(double a, double limit) { return fabs(a) > limit ? 1.0 : 0.0; }

static void write_row(bench *b, long k, const signals_t *s, double desired, v3 wanted, v3 applied, double *out) {
    const numbers *n = &b->n;
    const plant_state *p = &b->plant;
    int pressing = b->sequence.phase == CONTACT;
    *out++ = k * n->tick;
    *out++ = b->sequence.phase;
    out = put(out, p->q);
    out = put(out, p->qd);
    out = put(out, pose_of(&n->arm, directions_of(p->q), p->q));
    out = put(out, s->x);
    out = put(out, s->xd);
    out = put(out, vec(s->velocity, s->acceleration, s->smooth_acceleration));
    out = put(out, vec(b->sequence.x_d, n->start.y, n->start.z));
    out = put(out, vec(b->felt.normal, b->felt.tangential, s->sampled));
    *out++ = s->f;
    *out++ = desired;
    out = put(out, applied);
    v3 limit = n->model.limits;
    out = put(out, vec(beyond(wanted.x, limit.x), beyond(wanted.y, limit.y), beyond(wanted.z, limit.z)));
    out = put(out, b->felt.friction);
    *out++ = b->felt.penetration;
    *out++ = p->surface.contact;
    *out++ = pressing ? s->x.x - b->sequence.x0 : 0.0;
    out = put(out, b->thesis.theta);
    out = put(out, b->raw.theta);
    out = put(out, b->matched.theta);
    out = put(out, squares_std(&b->matched));
    out = put(out, b->command);
    put(out, vec(norm(b->net.hidden[0], HIDDEN * (INPUTS + 1)), norm(b->net.output[0], OUTPUTS * (HIDDEN + 1)),
                 gain(&b->net, &n->outputs.x, n->learning_rate)));
}
static void tick(bench *b, long k, double noise, double *out) {
    const numbers *n = &b->n;
    double sampled = convert(b->sensor.line, n->input.full_scale, b->input_code);
    signals_t s = condition(n, &b->conditioning, encoded3(n, b->plant.q), sampled);
    sequence_step(n, &b->sequence, s.x.x, s.f);
    estimate(b, &s);
    arm_model model = model_of(&n->model, directions_of(s.q), s.qd);
    v3 at = vec(b->sequence.x_d, n->start.y, n->start.z), wanted;
    double desired = 0.0;
    if (b->sequence.phase == CONTACT) {
        desired = desired_force(n, b->sequence.since);
        wanted = press(b, &s, at, desired, &model);
    } else {
        wanted = position_torque(n->approach_kp, n->approach_kv, &s, at, vec(1.0, 1.0, 1.0), &model);
        b->x_before = s.x;
        b->command = vec(0.0, 0.0, 0.0);
    }
    v3 one = vec(1.0, 1.0, 1.0), r = vec(s.qd.x / n->blend.x, s.qd.y / n->blend.y, s.qd.z / n->blend.z);
    wanted = add(wanted, mul(n->compensation, clip3(r, one)));
    v3 held = clip3(wanted, n->model.limits), full = n->output.full_scale, code = b->output_code;
    v3 torque = vec(convert(held.x, full.x, code.x), convert(held.y, full.y, code.y), convert(held.z, full.z, code.z));
    write_row(b, k, &s, desired, wanted, torque, out);
    int steps = (int)n->steps;
    double dt = n->tick / n->steps;
    for (int j = 0; j < steps; j++) {
        b->felt = plant_step(n, &b->plant, torque, dt);
        double rough = noise * (1.0 + n->roughness * fabs(b->felt.rate));
        sensor_step(n, &b->sensor, b->felt.normal + b->felt.inertial, k * steps + j, rough, b->sensor_code);
    }
}

/* So many ticks, the first being the k-th; a row of `width` numbers each. */
void bench_march(bench *b, long k, long ticks, const double *noise, double *out, long width) {
    for (long i = 0; i < ticks; i++) tick(b, k + i, noise[i], out + i * width);
}
