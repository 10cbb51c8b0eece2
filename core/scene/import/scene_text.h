/// The text of a scene, as `crt import` writes it: names and numbers in YAML, what was lost, and a view.
#pragma once

#include "base/vec3d.h"
#include "scene/import/inner_view.h"

#include <array>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// A name as YAML: plain where it can be, else in double quotes.
std::string yamlText(std::string_view name);
/// The shortest decimals that read back as the same double.
std::string yamlNumber(double value);
std::string yamlList(const double* values, std::size_t count);
template <std::size_t kCount>
std::string yamlList(const std::array<double, kCount>& values) {
    return yamlList(values.data(), kCount);
}

/// Names that are given once each, and that no number or word of YAML looks like.
class UniqueNames {
public:
    /// `name`, or `fallback` where it is empty, or one of them with a number behind it.
    std::string take(const std::string& name, const std::string& fallback);

private:
    std::set<std::string> taken_{"from_mtl"};
    std::map<std::string, std::size_t> next_;  ///< The number to try first behind a name.
};

/// Differences between a file and its scene: features that are lost or approximated, each with its count,
/// and features that were added.
class Losses {
public:
    void add(const std::string& what) { ++count_[what]; }
    void choose(const std::string& what) { chosen_.push_back(what); }
    const std::vector<std::string>& chosen() const { return chosen_; }
    /// "lines left out (3)", each.
    std::vector<std::string> list() const;

private:
    std::map<std::string, std::size_t> count_;
    std::vector<std::string> chosen_;
};

/// A box around points.
struct Bounds {
    Vec3d lower{kNone, kNone, kNone}, upper{-kNone, -kNone, -kNone};

    void add(const Vec3d& point);
    bool empty() const { return !(lower[0] <= upper[0]); }
    Vec3d centre() const;
    /// Half the diagonal.
    double radius() const;

private:
    static constexpr double kNone = std::numeric_limits<double>::infinity();
};

/// The section of a grey sky of radiance 0.5, and its reason. `brightness`: factor, for an image that is
/// exposed otherwise.
std::string chosenSky(const std::string& why, double brightness);

/// Light for a file that has none: a grey sky, which a white surface does not vanish into, and a soft lamp
/// over the left shoulder of `chosenCamera`; within a building, where that may not reach, one at the camera.
/// Both sections, as text.
std::string chosenLight(const std::optional<InnerView>& inner);

inline constexpr double kChosenFov_deg = 40, kChosenTurn_deg = 35;

/// Towards the chosen camera from what it looks at: from above, and so far to the right of the front.
Vec3d backOfChosenCamera(double turn_deg);

/// The given view, or a camera that sees all of the box, from the front, the right and above: the comment
/// and the section, as text. `aspect` is width over height.
std::string chosenCamera(const Bounds& bounds, const std::optional<InnerView>& inner, double aspect,
                         Losses& losses);

}  // namespace crt
