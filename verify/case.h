/// The suite of `crt verify`: scenes whose answer is known, and the registry that holds them. A case is the
/// same for every backend; its expected values come from a closed form, from deterministic quadrature, or
/// from a relation between images, never from an earlier render.
///
/// To add a case: a function that takes a Context (context.h), and a row in its group's table. The manual
/// (docs/stability.md), the list (`crt verify --list`) and the reports are made from the row.
#pragma once

#include "base/statistics.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crt::verify {

/// When a case runs: on every commit (all together within 90 s on two cores), before a merge (15 minutes),
/// or at night.
enum class Level { Commit, Merge, Nightly };

/// Best first. A statistical check whose interval is too wide is Inconclusive, which counts as a failure:
/// "could not reject" proves nothing.
enum class Verdict {
    Pass,
    NotApplicable,  ///< Cannot be asked of this backend or of crt; the outcome's note says why.
    Inconclusive,
    Fail,
};

/// Of every interval of an outcome.
inline constexpr double kConfidence = 0.999;

/// One question of a case and its answer.
struct Outcome {
    std::string what;                 ///< "albedo 0.5, depth 8"
    Verdict verdict = Verdict::Fail;
    std::optional<double> expected, measured;
    std::optional<stats::Interval> interval;  ///< Of kConfidence, of `measured`, where it was estimated.
    std::string tolerance;            ///< "± 0.1 %", "same bits"
    std::string note;  ///< A figure to keep, or the reason why the case does not apply.
    std::string physics;              ///< Of a failure: what the numbers suggest.
};

class Context;

/// A row of the registry.
struct Case {
    std::string id;         ///< Group and number: "A03".
    std::string name;       ///< For the command line: "square-light". Unique, too.
    std::string title;      ///< The question.
    std::string expected;   ///< The answer, in words or as a formula.
    std::string source;     ///< The origin of the answer.
    std::string tolerance;  ///< As in the outcomes.
    Level level = Level::Commit;
    std::uint64_t needs = 0;  ///< Features (dialect/features.h) that a backend must have for this case.
    void (*run)(Context&) = nullptr;

    char group() const { return id.front(); }
};

/// A row of a compact table, its members in their order.
inline Case row(const char* id, const char* name, const char* title, const char* expected,
                const char* source, const char* tolerance, Level level, std::uint64_t needs,
                void (*run)(Context&)) {
    return {id, name, title, expected, source, tolerance, level, needs, run};
}

/// "A": "Closed forms".
std::string_view groupTitle(char group);
const char* name(Level level);
const char* name(Verdict verdict);
/// Reads "commit", "merge" or "nightly".
std::optional<Level> levelNamed(std::string_view text);

/// A case is as good as its worst outcome; one without any has tested nothing and fails.
Verdict worst(const std::vector<Outcome>& outcomes);
inline bool failed(Verdict verdict) { return verdict >= Verdict::Inconclusive; }

/// All cases, by id.
const std::vector<Case>& registry();

/// The registry's cases that `words` name, each an id (A03), a name (furnace) or a group (A), in the
/// registry's order; all when there are none. Cases of a higher level than `level` are left out unless named
/// one by one. Throws crt::Error(Usage) for a word that names nothing.
std::vector<const Case*> select(const std::vector<std::string>& words, Level level);

/// Groups, each in a separate file.
std::vector<Case> closedFormCases();     ///< A
std::vector<Case> glassCases();          ///< A, the part about smooth interfaces
std::vector<Case> scaleCases();          ///< B
std::vector<Case> geometryCases();       ///< C
std::vector<Case> rayCases();            ///< D
std::vector<Case> lightCases();          ///< E
std::vector<Case> pointLightCases();     ///< E, the part about lights without a surface
std::vector<Case> lightTreeCases();      ///< E, the part about many lights
std::vector<Case> environmentCases();    ///< E, the part about images and skies around a scene
std::vector<Case> spectralFilmCases();   ///< E, the part about bins and sensors
std::vector<Case> stiffCases();          ///< F
std::vector<Case> scatteringCases();     ///< G
std::vector<Case> roughSurfaceCases();   ///< G, microfacets
std::vector<Case> glasswareCases();      ///< G, rough glass and panes
std::vector<Case> paneCases();           ///< G, light that crosses panes
std::vector<Case> compositionCases();    ///< G, opacity and mixes
std::vector<Case> bodyCases();           ///< G, bodies of glass: one inside another, holes
std::vector<Case> shadingNormalCases();  ///< G, interpolated normals and normal maps
std::vector<Case> thinFilmCases();       ///< G, thin films
std::vector<Case> anisotropyCases();     ///< G, brushed surfaces
std::vector<Case> openPbrCases();        ///< G, openpbr
std::vector<Case> openPbrCoatCases();    ///< G, coats
std::vector<Case> tintCases();           ///< G, colours of mirrors, gloss and panes
std::vector<Case> sheetCases();          ///< G, thin sheets that light passes diffusely
std::vector<Case> screenCases();         ///< G, emission that is an image
std::vector<Case> roughByPlaceCases();   ///< G, gloss and coats whose roughness depends on the place
std::vector<Case> instanceCases();       ///< D, meshes that are stored once and placed many times
std::vector<Case> quadricCases();        ///< D and G, spheres, disks and cylinders
std::vector<Case> shapeLightCases();     ///< G, lamps that are such
std::vector<Case> colourCases();         ///< H
std::vector<Case> textureCases();        ///< H, the part about textures
std::vector<Case> accumulationCases();   ///< I
std::vector<Case> splatCases();          ///< I, the part about splats
std::vector<Case> cameraCases();         ///< J: lens and filter
std::vector<Case> firstHitCases();       ///< D, J: the outputs of first hits
std::vector<Case> imageCases();          ///< J
std::vector<Case> backendCases();        ///< L
std::vector<Case> exactRelationCases();  ///< M01 to M19
std::vector<Case> mutantCases();         ///< N
std::vector<Case> contactCases();        ///< O

}  // namespace crt::verify
