/// Films that must be the same, sample by sample.
#pragma once

#include "catch.h"
#include "film/film.h"

namespace crt::test {

inline void checkSame(const Film& film, const Film& expected) {
    CHECK(film.samples.text() == expected.samples.text());
    CHECK(film.sums == expected.sums);
    CHECK(film.counts == expected.counts);
    CHECK(film.primitives == expected.primitives);
    CHECK(film.splats == expected.splats);
}

}  // namespace crt::test
