/* Arm, friction, surface and force sensor over one step of the physics. */
#ifndef PLANT_H
#define PLANT_H

#include "arm.h"

typedef struct { double deflection, rate; int contact; } surface_state;
typedef struct { double bend, rate; } mode_state;
typedef struct { v3 q, qd, bristles; surface_state surface; double bend; mode_state mode; } plant_state;
typedef struct { double normal, tangential, penetration, inertial, rate; v3 friction; } touch_t;
typedef struct { memory first, second; double computing, held; memory line_filter; double line; } sensor_state;

INLINE double joint_friction(double s0, double s1, double s2, double coulomb, double fixed, double stribeck, double asymmetry,
                             double *z, double v, double dt) {
    double r = v / stribeck, side = (double)((v > 0.0) - (v < 0.0));
    double level = (coulomb + (fixed - coulomb) * exp(-(r * r))) * (1.0 + asymmetry * side), slip = fabs(v) / level;
    double next = (*z + dt * v) / (1.0 + dt * s0 * slip), damping = s1 / (1.0 + 0.25 * s1 * slip);
    double torque = s0 * next + 1.0 / dt * damping * (next - *z) + s2 * v;
    *z = next;
    return torque;
}
INLINE v3 friction_step(const friction_t *f, v3 *z, v3 v, double dt) {
    return vec(
        joint_friction(f->sigma0.x, f->sigma1.x, f->sigma2.x, f->coulomb.x, f->fixed.x, f->stribeck.x,
                       f->asymmetry, &z->x, v.x, dt),
        joint_friction(f->sigma0.y, f->sigma1.y, f->sigma2.y, f->coulomb.y, f->fixed.y, f->stribeck.y,
                       f->asymmetry, &z->y, v.y, dt),
        joint_friction(f->sigma0.z, f->sigma1.z, f->sigma2.z, f->coulomb.z, f->fixed.z, f->stribeck.z,
                       f->asymmetry, &z->z, v.z, dt));
}
INLINE double slide_step(const side_t *s, double *bend, double rate, double normal, double dt) {
    double pull = s->stiffness * (*bend + dt * rate) + s->damping * rate;
    double held = clip(pull, s->friction * (normal > 0.0 ? normal : 0.0));
    *bend = held == pull ? *bend + dt * rate : (held * dt + s->damping * *bend) / (s->stiffness * dt + s->damping);
    return -held;
}
INLINE void swing(const surface_t *f, surface_state *s, double dt) {
    double reach = dt * (f->damping + dt * f->stiffness);
    double weight = f->mass == 0.0 ? 1.0 : reach > 2.0 * f->mass ? 1.0 - f->mass / reach : 0.5;
    double inertia = f->mass / (weight * dt), push = inertia * s->rate - f->stiffness * s->deflection;
    double resistance = inertia + f->damping + weight * dt * f->stiffness, rate = resistance > 0.0 ? push / resistance : 0.0;
    s->deflection += dt * rate;
    s->rate += (rate - s->rate) / weight;
}

INLINE touch_t plant_step(const numbers *n, plant_state *s, v3 torque, double dt) {
    directions d = directions_of(s->q);
    arm_model model = model_of(&n->arm, d, s->qd);
    solver inertia = solver_of(model.M);
    v3 normal = model.J.r1, along = model.J.r2;
    mode_state bent = s->mode;
    double p = dot(n->arm.length, d.c) + bent.bend - n->wall, before = dot(normal, s->qd);
    touch_t felt;
    felt.friction = friction_step(&n->friction, &s->bristles, s->qd, dt);
    v3 drive = sub(sub(torque, model.h), felt.friction), per_normal = solved(inertia, normal);
    double tip_mass = 1.0 / (dot(normal, per_normal) + n->mode.mobility), force = 0.0, slide = 0.0;
    double springs_back = -n->mode.frequency * (2.0 * n->mode.damping * bent.rate + n->mode.frequency * bent.bend);
    if (s->surface.contact) {
        double v = before + bent.rate - 0.5 * dt * model.Jdqd.x, B = n->surface.damping;
        double elastic = n->surface.stiffness * p + B * v;
        double damping = (n->surface.stiffness * p + B * (v + 1e-3) - elastic) / 1e-3;
        double opposed = n->surface.mass + 0.5 * dt * damping, share = tip_mass / (tip_mass + opposed);
        double a = dot(normal, solved(inertia, drive)) + model.Jdqd.x + springs_back;
        force = (elastic + opposed * a) * share;
        slide = slide_step(&n->side, &s->bend, dot(along, s->qd), force, dt);
        drive = add(drive, scale(slide, along));
        a = dot(normal, solved(inertia, drive)) + model.Jdqd.x + springs_back;
        force = (elastic + opposed * a) * share;
    }
    double pressed = force > 0.0 ? force : 0.0, impulse = 0.0;
    s->qd = add(s->qd, scale(dt, sub(solved(inertia, drive), scale(pressed, per_normal))));
    s->q = add(s->q, scale(dt, s->qd));
    s->mode.rate += dt * (springs_back - n->mode.mobility * pressed);
    s->mode.bend += dt * s->mode.rate;
    v3 t = absolute(s->q);
    p = n->arm.length.x * cos(t.x) + n->arm.length.y * cos(t.y) + n->arm.length.z * cos(t.z);
    p += s->mode.bend - n->wall;
    double v = dot(normal, s->qd) + s->mode.rate;
    if (force < 0.0) {
        s->bend = 0.0;
        s->surface.contact = 0;
    }
    if (s->surface.contact) {
        s->surface.deflection = p;
        s->surface.rate = v;
    } else {
        swing(&n->surface, &s->surface, dt);
        if (p >= s->surface.deflection && v > s->surface.rate) {
            double common = (tip_mass * v + n->surface.mass * s->surface.rate) / (tip_mass + n->surface.mass);
            impulse = n->surface.mass * (common - s->surface.rate);
            s->surface.rate = common;
            s->surface.contact = 1;
            s->qd = sub(s->qd, scale(impulse, per_normal));
            s->mode.rate -= n->mode.mobility * impulse;
        }
    }
    felt.normal = pressed + impulse / dt;
    felt.tangential = -slide;
    felt.penetration = p;
    felt.rate = dot(normal, s->qd) + s->mode.rate;
    felt.inertial = n->beyond * ((felt.rate - before - bent.rate) / dt + model.Jdqd.x);
    return felt;
}

INLINE void sensor_step(const numbers *n, sensor_state *s, double force, long k, double noise, double code) {
    double filtered = filter(&n->analog2, &s->second, filter(&n->analog1, &s->first, force)), line = s->held;
    long sampling = (long)n->sampling, rate = (long)n->rate, at = (k * sampling - (long)n->shift) % rate;
    if ((at < 0 ? at + rate : at) < sampling) {
        line = s->held = s->computing;
        s->computing = convert(filtered + n->noise * noise, n->sensor.full_scale, code);
    }
    double smooth = filter(&n->line, &s->line_filter, line);
    s->line = n->filtered == 1.0 ? smooth : line;
}

#endif
