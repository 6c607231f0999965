/* The planar arm with three joints, in the absolute angles of its links. */
#ifndef ARM_H
#define ARM_H

#include "parts.h"

typedef struct { v3 c, s; } directions;
typedef struct { m3 J; v3 Jdqd; m3 M; v3 h; } arm_model;

INLINE v3 absolute(v3 q) { double t2 = q.x + q.y; return vec(q.x, t2, t2 + q.z); }
INLINE v3 onto_joints(v3 e) { double e2 = e.y + e.z; return vec(e.x + e2, e2, e.z); }
INLINE directions directions_of(v3 q) {
    v3 t = absolute(q);
    directions d = {vec(cos(t.x), cos(t.y), cos(t.z)), vec(sin(t.x), sin(t.y), sin(t.z))};
    return d;
}
INLINE v3 pose_of(const arm_t *arm, directions d, v3 q) {
    return vec(dot(arm->length, d.c), dot(arm->length, d.s), q.x + q.y + q.z);
}
INLINE arm_model model_of(const arm_t *arm, directions d, v3 qd) {
    v3 a = arm->length, m = arm->mass, r = add(a, arm->com), c = d.c, s = d.s, w = absolute(qd);
    v3 own = add(arm->moment, add(mul(mul(m, r), r), mul(mul(vec(m.y + m.z, m.z, 0.0), a), a)));
    double third = m.z * r.z, k12 = a.x * (m.y * r.y + m.z * a.y), k13 = a.x * third, k23 = a.y * third;
    double x12 = k12 * (c.x * c.y + s.x * s.y), x13 = k13 * (c.x * c.z + s.x * s.z), x23 = k23 * (c.y * c.z + s.y * s.z);
    double m33 = own.z, m23 = x23 + m33, m13 = x13 + m23, m22 = own.y + x23 + m23;
    double m12 = x12 + own.y + x23 + m13, m11 = own.x + x12 + x13 + m12;
    v3 v = mul(w, w), p = mul(a, v);
    double y12 = k12 * (s.x * c.y - c.x * s.y), y13 = k13 * (s.x * c.z - c.x * s.z), y23 = k23 * (s.y * c.z - c.y * s.z);
    arm_model model = {
        mat(onto_joints(scale(-1.0, mul(a, s))), onto_joints(mul(a, c)), vec(1.0, 1.0, 1.0)),
        vec(-dot(p, c), -dot(p, s), 0.0),
        mat(vec(m11, m12, m13), vec(m12, m22, m23), vec(m13, m23, m33)),
        onto_joints(vec(y12 * v.y + y13 * v.z, y23 * v.z - y12 * v.x, -(y13 * v.x) - y23 * v.y)),
    };
    return model;
}

#endif
