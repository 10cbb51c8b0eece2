"""The samples that are left, and the sizes of parts."""

import random

import pytest

from crt.sample_ranges import STEP, Missing, PartSize


def covered(ranges):
    return [i for first, end in ranges for i in range(first, end)]


def test_parts_are_what_is_missing_and_no_more():
    chance = random.Random(1)
    for _ in range(300):
        end = chance.randrange(1, 200)
        cuts = sorted(chance.sample(range(260), 2 * chance.randrange(4)))
        done = list(zip(cuts[::2], cuts[1::2]))
        missing = Missing(done, end)
        wanted = set(range(end)) - set(covered(done))
        assert missing.left == len(wanted)
        parts = []
        while (part := missing.take(chance.choice([1, 2, 7, 16, 40]))) is not None:
            parts.append(part)
            assert part[0] < part[1]
        assert sorted(covered(parts)) == sorted(wanted) and missing.left == 0


def test_a_part_that_failed_is_given_again():
    missing = Missing([], 64)
    first = missing.take(16)
    missing.take(16)
    missing.give_back(*first)
    assert missing.left == 48 and missing.take(16) == first


def test_parts_are_of_whole_turns():
    missing = Missing([(0, 5)], 1000)
    assert missing.take(70) == (5, 80)
    while (part := missing.take(70)) is not None:
        assert part[0] % STEP == 0 and (part[1] % STEP == 0 or part[1] == 1000)
    assert Missing([], 9).take(3) == (0, 4)


@pytest.mark.parametrize("samples", [2, 5, 17, 33, 63, 65, 81, 1000])
def test_parts_are_hardly_longer_than_wanted(samples):
    """The last parts are to end together."""
    first, end = Missing([], 10_000).take(samples)
    assert samples <= end - first <= 1.25 * samples


def test_sizes_follow_the_speed_and_shrink_towards_the_end():
    size = PartSize()
    assert size.next(20, 2.5, 10_000, 4) == STEP and not size.is_known(20) and PartSize(7).is_known(20)
    size.learn(16, 1.0)
    assert size.is_known(64) and not size.is_known(65)
    assert size.next(100, 2.5, 1e6, 4) == 64 * 16  # Grows step by step.
    size.learn(1024, 64.0)
    assert size.next(20, 2.5, 1e6, 4) == 320  # 16 samples a second, 20 seconds.
    assert size.next(20, 2.5, 800, 4) == 100  # Half of each thread's share.
    assert size.shrinks(20, 2559, 4) and not size.shrinks(20, 2560, 4)
    assert size.next(20, 2.5, 80, 4) == 40    # No less than 2.5 seconds.
    assert size.next(0.01, 0.01, 80, 4) == 2
    assert PartSize(7).next(20, 2.5, 1e6, 4) == 7
    assert PartSize(7).shrinks(20, 55, 4) and not PartSize(7).shrinks(20, 56, 4)
    assert not PartSize().shrinks(20, 1, 4)  # Nothing is known.
    assert PartSize().next(20, 2.5, 8, 4) == 2
