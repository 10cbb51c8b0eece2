/// Rough diffuse bases of plastics, by EON: what one reflection loses, worked out before rendering
/// (kernel/materials/rough_base.h).
#pragma once

#include "compile/coat.h"

#include <map>
#include <vector>

namespace crt {

/// Below it single precision cannot tell a base from Lambert's.
inline constexpr double kLeastBaseRoughness = 1e-6;

inline bool hasRoughBase(const Material& material) {
    return material.type == MaterialType::Plastic && material.diffuse_roughness > kLeastBaseRoughness;
}

struct RoughBase {
    /// L, at cosines in steps of 1/470: a table of as many values as a spectrum has.
    Spectrum loss;
    double most = 1;  ///< N: the greatest share of diffuse light that one reflection would send back.
    double mean = 0;  ///< L̄
};
using RoughBases = std::map<const Material*, RoughBase>;

/// Of all plastics that have one, equal ones worked out once. Null materials are skipped.
void countRoughBases(const std::vector<const Material*>& materials, TableWork& work);
RoughBases roughBasesOf(const std::vector<const Material*>& materials, const Coats& coats);

}  // namespace crt
