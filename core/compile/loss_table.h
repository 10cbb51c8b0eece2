/// One table of what the microfacets of a rough surface lose (kernel/compensation.h): what it depends on,
/// what it costs, and its values.
#pragma once

#include "kernel/layout.h"

#include <compare>
#include <vector>

namespace crt {

/// The inputs of a table.
struct LossKey {
    bool refracts;
    double least, most;  ///< Index, inside over outside.
    bool textured;
    double roughness;
    double narrowing;  ///< 0: isotropic; else `roughness` is the root of the width along the tangent.
    auto operator<=>(const LossKey&) const = default;
};

/// The surface of one row: one index of refraction, or a film at one wavelength.
struct Interface {
    double index = 0;                        ///< Inside over outside; 0: a metal.
    double film_index = 0, film_rounds = 0;  ///< Relative to the outside; 2 d / λ. 0: there is none.
    auto operator<=>(const Interface&) const = default;
};

/// The surfaces of the rows of a table, in order.
struct Across {
    std::vector<Interface> interfaces{{}};
    double first = 0, step = 1;  ///< Of what the kernel looks rows up by.
    auto operator<=>(const Across&) const = default;
};

struct LossPlan {
    LossKey key;
    Across across;
    auto operator<=>(const LossPlan&) const = default;
};

/// Rows by roughness or azimuth, side by side for what they are across.
struct LossTable {
    std::vector<float> rows;
    kernel::CrtLoss record{};  ///< Without its place in the blob.
};

/// Directions that a table looks at: nearly all of its time.
double stepsOf(const LossPlan& plan);

/// Makes all of them at the same time: most have few rows. The process keeps some of the tables, so that a
/// scene that is compiled again, or another one of the same materials, has them at once. [any thread]
std::vector<LossTable> lossTablesOf(const std::vector<LossPlan>& plans);

/// Drops the tables that are kept, for tests that compare tables made twice.
void forgetLossTables();

/// L(θ): the share of light towards a view at `cosine` that GGX microfacets of width `alpha` lose between
/// them, mirrored (and, unless `eta` is 0, refracted) once, Smith's shadowing correlated by height. `eta`:
/// index beyond over index before; 0: all light is mirrored.
double microfacetLoss(double cosine, double eta, double alpha);

}  // namespace crt
