/// Photometric files of luminaires, IES LM-63: 1986, 1991, 1995, 2002 and 2019.
///
/// Photometry of type C, which nearly all files have, is read; types A and B are refused by name. TILT=NONE
/// and TILT=INCLUDE: a lamp's loss when its luminaire is tilted is read over, as the file was measured in
/// the position in which it hangs. TILT=FILE is refused.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// Luminous intensity by direction: `candela[h * vertical_deg.size() + v]`, linear in both angles between.
struct IesProfile {
    /// From the nadir, increasing, within 0 to 180. Beyond the first and the last there is no light.
    std::vector<double> vertical_deg;
    /// 0 to 360, increasing, both ends there; or 0 alone: the same all round. Symmetry is written out.
    std::vector<double> horizontal_deg;
    std::vector<double> candela;  ///< At least 0; with multiplier and ballast factors.
};

inline constexpr std::uint64_t kMostIesBytes = std::uint64_t{64} << 20;
inline constexpr std::size_t kMostIesAngles = 10'000;          ///< Of each kind, in the file.
inline constexpr std::size_t kMostIesValues = std::size_t{1} << 22;  ///< Written out.

/// A file whose name ends in .ldt is EULUMDAT (eulumdat_file.h), any other IES. Throws crt::Error(Scene)
/// with file and line.
IesProfile readPhotometricFile(const std::string& path);
/// `name` as in messages.
IesProfile parseIes(std::string_view text, const std::string& name);

/// ∫ I dω in lumens, exact for what is linear between the angles.
double luminousFlux_lm(const IesProfile& profile);

}  // namespace crt
