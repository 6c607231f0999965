/* Operators whose meaning in Python is not that of one in C, as Numba compiles them; TYPE stands for any type. */

/* A TYPE from the beginning of an array. */
static const TYPE *read_TYPE(array1 a, TYPE *to) {
    memcpy(to, a.at, sizeof(TYPE));
    return to;
}

/* A TYPE to the beginning of an array. */
static void write_TYPE(array1 a, const TYPE *v) { memcpy(a.at, v, sizeof(TYPE)); }

/* The larger of two, as Python's max: the first where they are equal or not comparable. */
static TYPE larger(TYPE a, TYPE b) { return b > a ? b : a; }

/* The smaller of two, as Python's min. */
static TYPE smaller(TYPE a, TYPE b) { return b < a ? b : a; }

/* x ** 2. */
static double square(double x) { return x * x; }

/* x ** 3. */
static double cube(double x) { return x * (x * x); }

/* x ** 0.5. */
static double root(double x) { return x == -INFINITY ? INFINITY : fabs(sqrt(x)); }

/* a % b with Python's sign, that of b. */
static int64_t modulo(int64_t a, int64_t b) {
    int64_t rest = a % b;
    return rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest;
}

/* a // b of Python: rounded down. */
static int64_t floored(int64_t a, int64_t b) { return a / b - (a % b != 0 && (a % b < 0) != (b < 0)); }

/* a % b with Python's sign, that of b. */
static double modulo(double a, double b) {
    double rest;
    if (a > 0.0 && a < 9007199254740992.0 && a == (double)(int64_t)a && b >= 1.0 && b < 9007199254740992.0
        && b == (double)(int64_t)b) {
        return a - b * (double)(int64_t)(a / b); /* of whole numbers below 2^53: exact */
    }
    rest = fmod(a, b);
    if (b == 0.0) {
        return rest;
    }
    if (rest != 0.0) {
        return (b < 0.0) != (rest < 0.0) ? rest + b : rest;
    }
    return b < 0.0 ? -0.0 : 0.0;
}

/* a // b of Python: rounded down. */
static double floored(double a, double b) {
    double rest, whole = a / b, down;
    if (whole > 0.0 && whole < 1e15 && whole != (double)(int64_t)whole) {
        return (double)(int64_t)whole; /* the quotient lies between two whole numbers, so its rounded value does */
    }
    rest = fmod(a, b), whole = (a - rest) / b;
    if (b == 0.0) {
        return a / b;
    }
    if (rest != 0.0 && (b < 0.0) != (rest < 0.0)) {
        whole -= 1.0;
    }
    if (!(whole < 0.0 || whole > 0.0)) {
        return whole * whole * a / b;
    }
    down = floor(whole);
    return whole - down > 0.5 ? down + 1.0 : down;
}
