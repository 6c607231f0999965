/* Three-vectors and 3x3 matrices by value. */
#ifndef VECTOR_H
#define VECTOR_H

#include <math.h>

typedef struct { double x, y, z; } v3;
typedef struct { v3 r1, r2, r3; } m3;

#define INLINE static inline __attribute__((always_inline))

INLINE v3 vec(double x, double y, double z) { v3 v = {x, y, z}; return v; }
INLINE v3 add(v3 a, v3 b) { return vec(a.x + b.x, a.y + b.y, a.z + b.z); }
INLINE v3 sub(v3 a, v3 b) { return vec(a.x - b.x, a.y - b.y, a.z - b.z); }
INLINE v3 mul(v3 a, v3 b) { return vec(a.x * b.x, a.y * b.y, a.z * b.z); }
INLINE v3 scale(double k, v3 a) { return vec(k * a.x, k * a.y, k * a.z); }
INLINE v3 over(v3 a, double k) { return vec(a.x / k, a.y / k, a.z / k); }
INLINE double dot(v3 a, v3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

INLINE m3 mat(v3 a, v3 b, v3 c) { m3 m = {a, b, c}; return m; }
INLINE v3 times(m3 A, v3 b) { return vec(dot(A.r1, b), dot(A.r2, b), dot(A.r3, b)); }
INLINE m3 transposed(m3 A) {
    return mat(vec(A.r1.x, A.r2.x, A.r3.x), vec(A.r1.y, A.r2.y, A.r3.y), vec(A.r1.z, A.r2.z, A.r3.z));
}
INLINE v3 transposed_times(m3 A, v3 b) {
    return vec(A.r1.x * b.x + A.r2.x * b.y + A.r3.x * b.z, A.r1.y * b.x + A.r2.y * b.y + A.r3.y * b.z,
               A.r1.z * b.x + A.r2.z * b.y + A.r3.z * b.z);
}
INLINE m3 product(m3 A, m3 B) {
    return mat(transposed_times(B, A.r1), transposed_times(B, A.r2), transposed_times(B, A.r3));
}
/* A B^T */
INLINE m3 product_transposed(m3 A, m3 B) { return mat(times(B, A.r1), times(B, A.r2), times(B, A.r3)); }
INLINE m3 outer(v3 a, v3 b) { return mat(scale(a.x, b), scale(a.y, b), scale(a.z, b)); }
INLINE m3 madd(m3 A, m3 B) { return mat(add(A.r1, B.r1), add(A.r2, B.r2), add(A.r3, B.r3)); }
INLINE m3 msub(m3 A, m3 B) { return mat(sub(A.r1, B.r1), sub(A.r2, B.r2), sub(A.r3, B.r3)); }
INLINE m3 mscale(double k, m3 A) { return mat(scale(k, A.r1), scale(k, A.r2), scale(k, A.r3)); }

/* Cramer's rule, the adjugate and the determinant once for any number of right sides. */
typedef struct { m3 adjugate; double inverse_determinant; } solver;

INLINE solver solver_of(m3 A) {
    double a = A.r1.x, b = A.r1.y, c = A.r1.z, d = A.r2.x, e = A.r2.y, f = A.r2.z, g = A.r3.x, h = A.r3.y, i = A.r3.z;
    double u = e * i - f * h, v = f * g - d * i, w = d * h - e * g;
    solver s = {mat(vec(u, c * h - b * i, b * f - c * e), vec(v, a * i - c * g, c * d - a * f),
                    vec(w, b * g - a * h, a * e - b * d)),
                1.0 / (a * u + b * v + c * w)};
    return s;
}
INLINE v3 solved(solver s, v3 b) { return scale(s.inverse_determinant, times(s.adjugate, b)); }

INLINE double clip(double a, double limit) { return a < -limit ? -limit : a > limit ? limit : a; }
INLINE v3 clip3(v3 a, v3 limit) { return vec(clip(a.x, limit.x), clip(a.y, limit.y), clip(a.z, limit.z)); }

/* To a whole number, ties to even. */
INLINE double whole(double u) { const double w = 6755399441055744.0; return u + w - w; }

#endif
