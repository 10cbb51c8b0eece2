#include "scene/photometric_text.h"

namespace crt {
namespace {

void requireIncreasing(const PhotometricText& text, int line, const std::vector<double>& angles,
                       const char* kind) {
    for (std::size_t i = 1; i < angles.size(); ++i)
        if (!(angles[i] > angles[i - 1]))
            text.failAt(line, fmt::format("{} angles must increase, but {} follows {}", kind, angles[i],
                                          angles[i - 1]));
}

}  // namespace

void checkVertical(const PhotometricText& text, int line, const std::vector<double>& angles) {
    requireIncreasing(text, line, angles, "vertical");
    const double first = angles.front(), last = angles.back();
    if ((first != 0 && first != 90) || (last != 90 && last != 180) || first == last)
        text.failAt(line, fmt::format("vertical angles go from {} to {}; photometry of type C has 0 to 90, "
                                      "0 to 180 or 90 to 180",
                                      first, last));
}

PhotometricColumns allRound(const PhotometricText& text, int line, const std::vector<double>& angles) {
    requireIncreasing(text, line, angles, "horizontal");
    const double first = angles.front(), last = angles.back();
    PhotometricColumns all;
    for (std::size_t i = 0; i < angles.size(); ++i) {
        all.angles.push_back(angles[i]);
        all.of.push_back(i);
    }
    // Adds the columns there are, mirrored in the last one.
    const auto mirror = [&all](double in) {
        for (std::size_t i = all.angles.size() - 1; i-- > 0;) {
            all.angles.push_back(2 * in - all.angles[i]);
            all.of.push_back(all.of[i]);
        }
    };
    if (first == 90 && last == 270) {
        // Symmetric in the plane of 90 and 270 degrees: what lies at φ also lies at 180 − φ.
        PhotometricColumns turned;
        const auto add = [&](double angle, std::size_t column) {
            turned.angles.push_back(angle);
            turned.of.push_back(column);
        };
        for (std::size_t i = angles.size(); i-- > 0;)  // 0 to 90: from 180 to 90.
            if (angles[i] <= 180) add(180 - angles[i], i);
        const bool has_zero = turned.angles.front() == 0;
        for (std::size_t i = 1; i + 1 < angles.size(); ++i) add(angles[i], i);
        for (std::size_t i = angles.size(); i-- > 0;)  // 270 to 360: from 270 to 180.
            if (angles[i] >= 180) add(540 - angles[i], i);
        if (!has_zero)
            text.failAt(line, "horizontal angles from 90 to 270 degrees must have 180 among them");
        return turned;
    }
    if (first != 0 || (last != 0 && last != 90 && last != 180 && last != 360))
        text.failAt(line, fmt::format("horizontal angles go from {} to {}; photometry of type C has 0 "
                                      "alone, 0 to 90, 0 to 180, 90 to 270 or 0 to 360",
                                      first, last));
    if (last == 90) mirror(90);
    if (last == 90 || last == 180) mirror(180);
    return all;
}

void spread(const PhotometricColumns& columns, const std::vector<double>& measured, IesProfile& profile) {
    const std::size_t vertical = profile.vertical_deg.size();
    profile.horizontal_deg = columns.angles;
    profile.candela.clear();
    for (const std::size_t column : columns.of)
        profile.candela.insert(profile.candela.end(),
                               measured.begin() + static_cast<std::ptrdiff_t>(column * vertical),
                               measured.begin() + static_cast<std::ptrdiff_t>((column + 1) * vertical));
}

}  // namespace crt
