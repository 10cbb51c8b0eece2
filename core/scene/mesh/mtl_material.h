/// Materials of an MTL file → ours, and what was lost on the way.
#pragma once

#include "scene/mesh/mtl_file.h"
#include "scene/scene.h"

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>

namespace crt {

/// Encoding of Kd, Ks and Ke: linear, as Mitsuba, pbrt and Blender take them, or sRGB-encoded as colour
/// pickers show them.
enum class MtlColor { Linear, Srgb };

/// An image that a material names, and how it lies.
struct MtlMap {
    std::string file;                                  ///< The file exists; its contents were not read.
    std::array<double, 6> transform{1, 0, 0, 0, 1, 0};  ///< As of Texture.
    bool clamp = false;
    std::size_t channel = 0;  ///< Of a number: red, green, blue or alpha.
    SourcePlace place;
};

struct MtlMaterial {
    Material material;
    std::optional<MtlMap> map_kd;      ///< To take the place of the material's reflectance,
    std::optional<MtlMap> map_d;       ///< of its opacity,
    std::optional<MtlMap> norm;        ///< and of its normals.
    std::optional<Emission> emission;  ///< Ke, if it is not black.
    std::string spectrum_file;         ///< Read for crt_reflectance; empty without it.
};

/// The materials of one file together: what they became and what was left out, each with the number of
/// materials.
class MtlSummary {
public:
    void became(const std::string& kind) { ++kinds_[kind]; }
    /// A statement that was not taken at its word: "d without Ni above 1 read as opaque".
    void decided(const std::string& what) { ++decisions_[what]; }
    /// A keyword without effect that would be seen.
    void dropped(const std::string& keyword) { ++dropped_[keyword]; }
    /// The image of a keyword that was dropped for it.
    void notThere(const std::string& image) { not_there_.insert(image); }
    /// A keyword that crt does not know.
    void unknown(const std::string& keyword) { ++unknown_[keyword]; }
    /// A statement without the numbers that it needs; `what` begins with its keyword.
    void unreadable(const MtlText& material, const std::string& what) { note(material, what, unreadable_); }
    /// An option of a keyword, such as "map_Kd -mm", that would be seen and that crt does not apply.
    void notApplied(const MtlText& material, const std::string& what) { note(material, what, not_applied_); }

    bool empty() const { return kinds_.empty(); }
    /// True if anything differs from the file.
    bool lossy() const {
        return !(decisions_.empty() && dropped_.empty() && unknown_.empty() && unreadable_.empty() &&
                 not_applied_.empty());
    }
    /// "25 materials: 22 diffuse, 3 glass; dropped: Ks (20), map_Kd (18)"
    std::string text() const;

private:
    using Counts = std::map<std::string, int>;
    /// The number of statements, and the place of the first.
    struct Noted {
        int count = 0;
        std::string first;
    };
    using Places = std::map<std::string, Noted>;
    static std::string list(const Counts& counts);
    static std::string list(const Places& places);
    static void note(const MtlText& material, const std::string& what, Places& to);

    Counts kinds_, decisions_, dropped_, unknown_;
    Places unreadable_, not_applied_;
    std::set<std::string> not_there_;
};

/// A material of an MTL file as one of ours, by these rules, the first that fits (in full: mtlKeys()):
///
///  1. Ni above 1, and light passes (d < 1, or Tr > 0 without d, of a surface without images; a Tf that is
///     neither black nor white; illum 6, 7 or 9; illum 4 without a white Tf): Dielectric, smooth and clear.
///  2. Pm ≥ 0.5: Mirror with reflectance Kd. illum 3 or 5 with Kd ≤ 0.1 and a Ks: Mirror of reflectance
///  Ks.
///  3. Diffuse with reflectance Kd.
///
/// Of mirrors and diffuse surfaces map_d is the opacity, or d between 0 and 1.
/// A statement that cannot be read is as if it were left out. Adds what was decided and lost to `summary`.
/// Throws crt::Error(Scene) for a spectrum (crt_reflectance) that cannot be read or leaves [0, 1].
MtlMaterial mapMtlMaterial(const MtlText& mtl, MtlColor color, MtlSummary& summary);

}  // namespace crt
