#include "verify/case.h"

#include "base/error.h"
#include "scene/yaml/yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace crt::verify {
namespace {

constexpr std::array<std::pair<char, const char*>, 14> kGroups{{
    {'A', "Closed forms"},
    {'B', "Scale and position"},
    {'C', "Degenerate and awkward geometry"},
    {'D', "Rays and traversal"},
    {'E', "Lights"},
    {'F', "Stiff transport"},
    {'G', "Extremes of scattering"},
    {'H', "Spectrum and colour"},
    {'I', "Accumulation, random numbers, samplers"},
    {'J', "Image and camera"},
    {'L', "Floating point environment and backends"},
    {'M', "Relations between images"},
    {'N', "Faults that no other case would notice"},
    {'O', "Emitters in contact"},
}};

constexpr std::array kLevels{"commit", "merge", "nightly"};

}  // namespace

std::string_view groupTitle(char group) {
    for (const auto& [letter, title] : kGroups)
        if (letter == group) return title;
    return "";
}

const char* name(Level level) { return kLevels[static_cast<std::size_t>(level)]; }

const char* name(Verdict verdict) {
    switch (verdict) {
        case Verdict::Pass: return "pass";
        case Verdict::NotApplicable: return "not applicable";
        case Verdict::Inconclusive: return "INCONCLUSIVE";
        case Verdict::Fail: break;
    }
    return "FAIL";
}

std::optional<Level> levelNamed(std::string_view text) {
    for (std::size_t i = 0; i < kLevels.size(); ++i)
        if (text == kLevels[i]) return static_cast<Level>(i);
    return std::nullopt;
}

Verdict worst(const std::vector<Outcome>& outcomes) {
    if (outcomes.empty()) return Verdict::Fail;
    // If one part does not apply, the other part has still been answered.
    bool passed = false;
    Verdict verdict = Verdict::NotApplicable;
    for (const Outcome& o : outcomes) {
        if (failed(o.verdict)) verdict = std::max(verdict, o.verdict);
        passed = passed || o.verdict == Verdict::Pass;
    }
    return !failed(verdict) && passed ? Verdict::Pass : verdict;
}

const std::vector<Case>& registry() {
    static const std::vector<Case> cases = [] {
        std::vector<Case> all;
        for (const auto group :
             {closedFormCases, glassCases,         scaleCases,        geometryCases,      rayCases,
              lightCases,      pointLightCases,    lightTreeCases,    environmentCases,   spectralFilmCases,
              stiffCases,      scatteringCases,    roughSurfaceCases, glasswareCases,     paneCases,
              thinFilmCases,   anisotropyCases,    openPbrCases,      openPbrCoatCases,   compositionCases,
              bodyCases,       shadingNormalCases, quadricCases,      instanceCases,      shapeLightCases,
              colourCases,     textureCases,       accumulationCases, splatCases,         cameraCases,
              firstHitCases,   imageCases,         backendCases,      exactRelationCases, mutantCases,
              contactCases,    roughByPlaceCases,  tintCases,         sheetCases,         screenCases})
            for (Case& c : group()) all.push_back(std::move(c));
        std::sort(all.begin(), all.end(), [](const Case& a, const Case& b) { return a.id < b.id; });
        return all;
    }();
    return cases;
}

std::vector<const Case*> select(const std::vector<std::string>& words, Level level) {
    std::vector<const Case*> chosen;
    for (const Case& c : registry()) {
        bool wanted = words.empty() && c.level <= level;
        for (const std::string& word : words)
            wanted = wanted || word == c.id || word == c.name ||
                     (word.size() == 1 && word.front() == c.group() && c.level <= level);
        if (wanted) chosen.push_back(&c);
    }
    for (const std::string& word : words) {
        std::vector<std::string> known;
        for (const Case& c : registry())
            for (const std::string& n : {c.id, c.name, std::string(1, c.group())}) known.push_back(n);
        if (std::find(known.begin(), known.end(), word) != known.end()) continue;
        const std::string hint = didYouMean(word, known);
        throw Error(ErrorKind::Usage,
                    fmt::format("no case is called '{}'{}", word,
                                hint.empty() ? "; 'crt verify --list' shows them all" : "; " + hint));
    }
    return chosen;
}

}  // namespace crt::verify
