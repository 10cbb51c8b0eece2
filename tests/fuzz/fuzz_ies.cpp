// IES and EULUMDAT files → distributions. A EULUMDAT file begins with the byte 'L'.
#include "fuzz_target.h"

#include "scene/eulumdat_file.h"
#include "scene/ies_file.h"

#include <algorithm>
#include <cmath>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace crt;
    fuzz::expectRefusalOrSuccess(ErrorKind::Scene, [&] {
        const std::string_view text(reinterpret_cast<const char*>(data), size);
        const IesProfile profile = text.starts_with('L') ? parseEulumdat(text.substr(1), "a.ldt")
                                                         : parseIes(text, "a.ies");
        if (profile.candela.size() != profile.vertical_deg.size() * profile.horizontal_deg.size())
            fuzz::finding("ies", "a distribution of another size than its angles");
        if (!std::is_sorted(profile.horizontal_deg.begin(), profile.horizontal_deg.end()))
            fuzz::finding("ies", "horizontal angles do not increase");
        if (profile.horizontal_deg.size() > 1 &&
            (profile.horizontal_deg.front() != 0 || profile.horizontal_deg.back() != 360))
            fuzz::finding("ies", "a distribution that does not go all round");
        for (const double candela : profile.candela)
            if (!(candela >= 0) || !std::isfinite(candela)) fuzz::finding("ies", "no intensity");
        if (std::isnan(luminousFlux_lm(profile))) fuzz::finding("ies", "no flux");
    });
    return 0;
}
