"""Is the tip in contact? By a force that is told, or by sequential tests of position and force.

In free space the position travels and the force does not follow. Two hypotheses foretell each sample before it is
seen: "free", a constant level, and "contact", the fit of the samples so far. The logarithms of their likelihood ratio
are summed and held above zero (Page, Continuous inspection schemes, 1954); a hypothesis is left when the sum reaches
`ALARM`. Were the left one true, that would happen once in e^ALARM samples at most (Lorden, Procedures for reacting to a
change in distribution, 1971), for noise that is normal, white and known.
"""

from palpate._jit import law
from palpate._jit.elementary import log
from palpate._vector import Vec3
from palpate.identifiers.dimension import Four, Vec4
from palpate.identifiers.least_squares import long_run_variance, measure

ALARM = log(1e6)
"""Once in a million samples: at 480 Hz, in 35 minutes."""
MOST = ALARM / 3
"""Largest evidence of one sample: a single outlier is neither a touch nor the end of one."""
SOFTEST = 0.25
"""Share of the stiffness so far that a surface must keep, to be told from free space."""
TOLD = 3.0
"""Deviations by which a slope is told from none, and from the softest: wrong once in 700."""
_LOUDER = 4.0
"""How many times the noise's variance that of a departure from the level is taken for."""
_MEMORY = 1000.0
"""Samples that the level and the noise are told from."""
_SETTLED = 30.0
"""Samples from which the innovations tell the noise."""
_FEWEST = 8.0
"""Samples that make a level."""
_FOURTH = 70.0
"""Sum of the squares of a fourth difference's weights."""
_THIRD = 10.0
"""Sum of the squares of the weights of a third difference over two samples on each side."""
_EVIDENT = 32.0
"""Variances of the noise beyond which a reading is an outlier: of white noise, once in sixty million samples."""

SAMPLE = 6
"""A sample on its way: instant [ticks], force [N], a, v, x, and the number of its contact, 0 for none."""
TOUCHING, SINCE, CONTACTS, LOST, LEVEL, LEVELS, SPREAD, SUM, START = range(9)
"""In contact; since which instant; contacts so far, and how many ended; level of the force [N], of how many samples,
and its variance; the sum under test and the instant at which it was last zero."""
WEIGHT, SQUARES, PRODUCTS, LAST, POWER, HEARD, PAST = range(10, 17)
"""Of the innovations, as in `ErrorCovariance`; squares of the force's fourth differences, how many, and the last four
forces."""
COUNT, QUANTUM, HIGHEST, STUCK, FROM, PAIRS, EQUAL, BEFORE, WHERE, LIMITED = range(20, 30)
"""Forces seen; smallest change; highest; readings in a row that stand there, since which position; pairs of readings
between which the tip moved, how many were equal; last force and position; whether the range was found to end."""
RUN_X, RUN_XX, RUN_XF = range(30, 33)
"""Of the samples under test: mean position, and the sums about the means of it squared and times the force."""
KNOWN = 33
"""The fit of all samples, theta and its root; then that of those that came through, which the first falls back on."""
CERTAIN = KNOWN + 20
FIELDS = CERTAIN + 20
_SIZE = Four()


@law
def decide_contact(contact, queue, capacity, read, settling, touch, averaged):
    """By the mean of some samples, with hysteresis: noise must not choose which samples of a light contact count."""
    k = int((read - 1.0) % capacity) * SAMPLE
    total = 0.0
    for i in range(int(min(averaged, read))):
        total += queue[int((read - 1.0 - i) % capacity) * SAMPLE + 1]
    if contact[TOUCHING] == 0.0 and total > touch * averaged:
        contact[TOUCHING], contact[SINCE] = 1.0, queue[k]
        contact[CONTACTS] += 1.0
    elif contact[TOUCHING] > 0.0 and total < 0.5 * touch * averaged:
        contact[TOUCHING] = 0.0
        contact[LOST] += 1.0
        _mark(queue, capacity, read, -1.0, 0.0)
    if contact[TOUCHING] > 0.0 and queue[k] >= contact[SINCE] + settling:
        queue[k + 5] = contact[CONTACTS]


@law
def find_contact(contact, queue, capacity, read, settling):
    """By the two tests; samples on their way are taken back, or after all, as far as the tests point back."""
    k = int((read - 1.0) % capacity) * SAMPLE
    instant, force = queue[k], queue[k + 1]
    if contact[TOUCHING] > 0.0:
        phi = Vec4(Vec3(queue[k + 2], queue[k + 3], queue[k + 4]), 1.0)
        if _detect_loss(contact, phi, force, instant):
            contact[TOUCHING] = 0.0
            contact[LOST] += 1.0
            for i in range(CERTAIN - KNOWN):
                contact[KNOWN + i] = contact[CERTAIN + i]
            _mark(queue, capacity, read, contact[START], 0.0)
        elif instant >= contact[SINCE] + settling:
            queue[k + 5] = contact[CONTACTS]
    elif _detect_touch(contact, force, instant):
        contact[TOUCHING], contact[SINCE] = 1.0, contact[START]
        contact[CONTACTS] += 1.0
        contact[SUM] = contact[LEVELS] = 0.0
        _mark(queue, capacity, read, contact[START] + settling, contact[CONTACTS])


@law
def pending(contact, instant):
    """Whether a test that is under way may still point back to an instant."""
    return contact[SUM] > 0.0 and instant >= contact[START]


@law
def _mark(queue, capacity, read, since, number):
    """Gives the samples on their way from an instant on to a contact, those of them that have a regressor."""
    for i in range(int(min(capacity, read))):
        k = int((read - 1.0 - i) % capacity) * SAMPLE
        if queue[k] < since:
            break
        queue[k + 5] = number if queue[k + 2] == queue[k + 2] else 0.0


@law
def hear_noise(contact, force):
    """Adds to what the force's noise is told from while nothing else is known: a motion hardly shows in it."""
    p = PAST
    if contact[COUNT] > 4.0:
        fourth = force - 4.0 * contact[p] + 6.0 * contact[p + 1] - 4.0 * contact[p + 2] + contact[p + 3]
        contact[HEARD] = min(contact[HEARD] + 1.0, _MEMORY)
        contact[POWER] += (fourth * fourth / _FOURTH - contact[POWER]) / contact[HEARD]
    contact[p + 3], contact[p + 2], contact[p + 1], contact[p] = (
        contact[p + 2],
        contact[p + 1],
        contact[p],
        force,
    )


@law
def is_outlier(contact, queue, capacity, read, apart):
    """True if the readings around one agree without it, and not with it: no force is one sample long.

    Beside what two neighbours on each side make of it, a reading alone has six times its error in their fourth
    difference. The third difference of the four is theirs alone: a step, a ramp and a touch stand in it as well, and
    are believed from their first sample on. Compared is the variance that each would have as noise.

    Args:
        contact: of which the noise is known.
        queue: samples on their way.
        capacity: of the queue.
        read: number of the sample.
        apart: time over which its neighbours are four even steps [ticks].
    """
    if contact[HEARD] < _SETTLED or read < 2.0:
        return False
    a = int((read - 2.0) % capacity) * SAMPLE
    b = int((read - 1.0) % capacity) * SAMPLE
    c = int(read % capacity) * SAMPLE
    d = int((read + 1.0) % capacity) * SAMPLE
    e = int((read + 2.0) % capacity) * SAMPLE
    if not 0.0 < queue[e] - queue[a] < apart:
        return False
    third = queue[e + 1] - 2.0 * queue[d + 1] + 2.0 * queue[b + 1] - queue[a + 1]
    fourth = queue[a + 1] - 4.0 * queue[b + 1] + 6.0 * queue[c + 1] - 4.0 * queue[d + 1] + queue[e + 1]
    noise = max(contact[POWER], contact[QUANTUM] ** 2 / 12.0, third * third / _THIRD, 1e-300)
    return fourth * fourth / _FOURTH > _EVIDENT * noise


@law
def _noise(contact):
    """Variance of the force's noise [N^2]: no less than its steps make, nor than the fit leaves."""
    variance = max(contact[POWER], contact[QUANTUM] ** 2 / 12.0, 1e-300)
    if contact[WEIGHT] < _SETTLED:
        return variance
    return max(variance, long_run_variance(contact[WEIGHT], contact[SQUARES], contact[PRODUCTS], 4.0))


@law
def _detect_touch(contact, force, instant):
    """Whether the force has left its level, one sample further on."""
    n, e = contact[LEVELS], force - contact[LEVEL]
    if n >= _FEWEST:
        ratio = e * e / (max(_noise(contact), contact[SPREAD]) * (1.0 + 1.0 / n))
        said = 0.5 * ((1.0 - 1.0 / _LOUDER) * ratio - log(_LOUDER))
        contact[SUM] = max(contact[SUM] + min(said, MOST), 0.0)
    if contact[SUM] == 0.0:
        n = contact[LEVELS] = min(n + 1.0, _MEMORY)
        contact[START] = instant
        contact[LEVEL] += e / n
        if n > 1.0:
            contact[SPREAD] += (e * e * (n - 1.0) / n - contact[SPREAD]) / n
    return contact[SUM] > ALARM


@law
def _detect_loss(contact, phi, force, instant):
    """Whether the force has stopped following the position, one sample further on; the fit learns the sample.

    The surface never pulls: once the fit knows better than the noise, only a foretold force below the measured one
    speaks for free space. A surface that has become another is no free space: the level must not follow the position,
    not even as a surface of `SOFTEST` would; until that is told, the samples wait.
    """
    theta, S = _SIZE.vector(contact, KNOWN), _SIZE.matrix(contact, KNOWN + 4)
    after, S, _, e, a = measure(theta, S, phi, force, 1.0)
    noise, n = _noise(contact), contact[LEVELS]
    if n > 0.0:
        from_level = force - contact[LEVEL]
        wide = 1.0 + 1.0 / n
        said = 0.5 * ((e * e / a - from_level * from_level / wide) / noise + log(a / wide))
        if a < 2.0 and e < 0.0:
            said = min(said, 0.0)
        contact[SUM] = max(contact[SUM] + max(min(said, MOST), -MOST), 0.0)
    _count(contact, phi.v.z, force, instant)
    if contact[SUM] > ALARM:
        slope = _follows(contact, noise)
        if slope < 0.0:
            contact[SUM], contact[SPREAD] = 0.0, noise
            return True
        contact[SUM] = 0.0 if slope > 0.0 else ALARM
    if (
        contact[SUM] == 0.0 or a > 2.0
    ):  # while it is not told whether it is one of a contact, it teaches nothing
        _SIZE.put_vector(contact, KNOWN, after)
        _SIZE.put_matrix(contact, KNOWN + 4, S)
    if contact[SUM] == 0.0:
        e, keep = e / a**0.5, 1.0 - 1.0 / _MEMORY
        contact[WEIGHT] = keep * contact[WEIGHT] + 1.0
        contact[SQUARES] = keep * contact[SQUARES] + e * e
        contact[PRODUCTS] = keep * contact[PRODUCTS] + e * contact[LAST]
        contact[LAST] = e
    return False


@law
def _count(contact, x, force, instant):
    """Adds a sample to the level under test, or begins it anew."""
    if contact[SUM] == 0.0:
        contact[LEVEL], contact[LEVELS], contact[START] = force, 1.0, instant
        contact[RUN_X], contact[RUN_XX], contact[RUN_XF] = x, 0.0, 0.0
        return
    n = contact[LEVELS] = contact[LEVELS] + 1.0
    moved, pushed = x - contact[RUN_X], force - contact[LEVEL]
    contact[RUN_X] += moved / n
    contact[LEVEL] += pushed / n
    contact[RUN_XX] += moved * moved * (n - 1.0) / n
    contact[RUN_XF] += moved * pushed * (n - 1.0) / n


@law
def _follows(contact, noise):
    """1 if the force under test follows the position, -1 if it does not, 0 while that is not told."""
    if contact[RUN_XX] == 0.0:
        return 0.0
    slope, deviation = contact[RUN_XF] / contact[RUN_XX], (noise / contact[RUN_XX]) ** 0.5
    least = SOFTEST * contact[CERTAIN + 2]
    if least <= 0.0:  # nothing came through yet
        return 1.0 if abs(slope) > TOLD * deviation else -1.0
    if 2.0 * TOLD * deviation > least:
        return 0.0
    return 1.0 if slope > 0.5 * least else -1.0


@law
def learn_in_contact(contact, a, v, x, force):
    """Takes a sample that came through into the fit of such."""
    phi = Vec4(Vec3(a, v, x), 1.0)
    theta, S = _SIZE.vector(contact, CERTAIN), _SIZE.matrix(contact, CERTAIN + 4)
    theta, S, _, _, _ = measure(theta, S, phi, force, 1.0)
    _SIZE.put_vector(contact, CERTAIN, theta)
    _SIZE.put_matrix(contact, CERTAIN + 4, S)


@law
def follow_saturation(contact, force, x):
    """Follows a force that stands at its highest reading while the tip moves on.

    By chance so many equal readings in a row come less than once in a thousand logs, were equal neighbours as rare
    elsewhere as there.
    """
    contact[COUNT] += 1.0
    if contact[COUNT] > 1.0:
        change = abs(force - contact[BEFORE])
        if change > 0.0 and (change < contact[QUANTUM] or contact[QUANTUM] == 0.0):
            contact[QUANTUM] = change
        if x != contact[WHERE] and force < contact[HIGHEST]:
            contact[PAIRS] += 1.0
            contact[EQUAL] += 1.0 if change == 0.0 else 0.0
    if contact[COUNT] == 1.0 or force > contact[HIGHEST]:
        contact[HIGHEST], contact[STUCK], contact[FROM], contact[LIMITED] = force, 1.0, x, 0.0
    elif force == contact[HIGHEST]:
        if contact[BEFORE] != force:
            contact[STUCK], contact[FROM] = 0.0, x
        contact[STUCK] += 1.0
        rare = log((contact[PAIRS] + 2.0) / (contact[EQUAL] + 1.0)) * (contact[STUCK] - 1.0)
        if contact[TOUCHING] > 0.0 and rare > log(1e3 * (contact[PAIRS] + 1.0)):
            far = abs(x - contact[FROM]) * contact[CERTAIN + 2]
            if far > 3.0 * contact[QUANTUM]:
                contact[LIMITED] = 1.0
    contact[BEFORE], contact[WHERE] = force, x
