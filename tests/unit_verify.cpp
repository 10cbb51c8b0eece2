// The suite of `crt verify` itself: its registry, its verdicts, its diagnoses, and that its expectations are
// right.
#include "catch.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"
#include "verify/case.h"
#include "verify/context.h"
#include "verify/physics.h"
#include "verify/references.h"
#include "verify/report.h"
#include "verify/variants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <regex>
#include <set>
#include <string>

using namespace crt;
using namespace crt::verify;

namespace {

Outcome outcome(Verdict verdict) {
    Outcome o;
    o.verdict = verdict;
    return o;
}

/// A row of pixels of one sample each, with these values of Y.
Film rowOf(const std::vector<double>& y) {
    const auto width = static_cast<std::uint32_t>(y.size());
    Film film({width, 1, CRT_CHANNELS_BASE, 0});
    for (std::size_t x = 0; x < y.size(); ++x) {
        film.sums[2 * (x * CRT_CHANNELS_BASE + 1)] = y[x];
        film.counts[x] = 1;
    }
    return film;
}

}  // namespace

TEST_CASE("every case of the suite says what is asked, what is expected and from where", "[verify]") {
    std::set<std::string> ids, names;
    for (const Case& c : registry()) {
        INFO(c.id << " " << c.name);
        CHECK(ids.insert(c.id).second);
        CHECK(names.insert(c.name).second);
        CHECK(c.id.size() == 3);
        CHECK_FALSE(groupTitle(c.group()).empty());
        CHECK_FALSE((c.title.empty() || c.expected.empty() || c.source.empty() || c.tolerance.empty()));
        CHECK(c.run != nullptr);
    }
}

TEST_CASE("the scenes of the relations need together all that the kernel has", "[verify]") {
    std::uint64_t together = 0;
    for (const Variant& v : variants(8)) together |= v.needs;
    INFO("no scene needs " << featureNames(CRT_FEATURES_ALL & ~together));
    CHECK(together == CRT_FEATURES_ALL);
}

TEST_CASE("the parts of one run share a column of docs/stability.md", "[verify][docs]") {
    const auto part = [](const char* backend, const char* id) {
        return fmt::format(R"({{"backend": {{"name": "{}", "device": "a device"}}, "level": "commit",
                               "crt": {{"version": "1"}},
                               "cases": [{{"id": "{}", "verdict": "{}", "outcomes": []}}]}})",
                           backend, id, id[0] == 'A' ? "pass" : "FAIL");
    };
    const std::string text =
        registryMarkdown({part("one", "A01"), part("one", "B01"), part("other", "A01")});
    const auto lineFrom = [&](const char* begin) {
        const std::size_t at = text.find(begin);
        REQUIRE(at != std::string::npos);
        return text.substr(at, text.find('\n', at) - at);
    };
    CHECK_THAT(lineFrom("| A01 "), Catch::EndsWith("| commit | pass | pass |"));
    CHECK_THAT(lineFrom("| B01 "), Catch::EndsWith(" | FAIL | – |"));
    CHECK(text.find("Figures of one: level commit, a device, crt 1") != std::string::npos);
    CHECK(text.find("Figures of one:", text.find("Figures of one:") + 1) == std::string::npos);
}

TEST_CASE("docs/stability.md is what the registry says", "[verify][docs]") {
    std::ifstream in(CRT_SOURCE_DIR "/docs/stability.md");
    const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    for (const Case& c : registry()) {
        INFO("run crt verify --markdown, see the head of docs/stability.md; the row of " << c.id
                                                                                         << " differs");
        CHECK(text.find(markdownRow(c)) != std::string::npos);
    }
    // And nothing else: a case that is gone from the registry is missed here.
    std::size_t rows = 0;
    const std::regex row("\\n\\| ([A-Z][0-9][0-9]) `");
    for (std::sregex_iterator it(text.begin(), text.end(), row); it != std::sregex_iterator();
         ++it, ++rows) {
        const std::string id = (*it)[1];
        INFO("the registry has no case " << id);
        CHECK(std::any_of(registry().begin(), registry().end(), [&](const Case& c) { return c.id == id; }));
    }
    CHECK(rows == registry().size());
}

TEST_CASE("cases are chosen by id, name, group and level", "[verify]") {
    CHECK(select({"A03"}, Level::Commit).size() == 1);
    CHECK(select({"furnace", "A03"}, Level::Commit).size() == 2);
    CHECK(select({"H"}, Level::Merge).size() > select({"H"}, Level::Commit).size());
    CHECK(select({}, Level::Nightly).size() == registry().size());
    CHECK_THROWS_WITH(select({"furnance"}, Level::Commit),
                      Contains("no case is called 'furnance'") && Contains("furnace"));
}

TEST_CASE("a case is as good as its worst outcome", "[verify]") {
    CHECK(worst({}) == Verdict::Fail);
    CHECK(worst({outcome(Verdict::Pass), outcome(Verdict::Inconclusive)}) == Verdict::Inconclusive);
    CHECK(worst({outcome(Verdict::Fail), outcome(Verdict::Inconclusive)}) == Verdict::Fail);
    CHECK(worst({outcome(Verdict::Pass), outcome(Verdict::NotApplicable)}) == Verdict::Pass);
    CHECK(worst({outcome(Verdict::NotApplicable)}) == Verdict::NotApplicable);
    CHECK(failed(Verdict::Inconclusive));
    CHECK_FALSE(failed(Verdict::NotApplicable));
}

TEST_CASE("a wrong figure is traced to the mistake that gives it", "[verify]") {
    const std::vector<Mistake> mistakes{{0.5, "a cosine is missing"}, {0.7, "something else"}};
    CHECK(diagnose(0.503, 1, 0, mistakes) == "a cosine is missing");
    CHECK_THAT(diagnose(3.1416, 1, 0, mistakes), Contains("division by pi missing"));
    CHECK_THAT(diagnose(2, 1, 0, {}), Contains("counted twice"));
    CHECK_THAT(diagnose(0, 1, 0, {}), Contains("black"));
    CHECK_THAT(diagnose(1e-3, 0, 0, {}), Contains("leak"));
    CHECK_THAT(diagnose(std::nan(""), 1, 0, {}), Contains("not a finite number"));
}

TEST_CASE(
    "the worst pixel is the one farthest from what is expected, "
    "and a pixel that is no number is worse than any",
    "[verify]") {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const Film unit = rowOf({1, 1, 1});
    CHECK(worstRatio(rowOf({1.5, 0.25, 1}), unit) == 0.25);
    CHECK(worstRatio(rowOf({0.75, 1.5, 1}), unit) == 1.5);
    CHECK(worstRatio(rowOf({2, 2, 2}), unit, 2) == 1);
    CHECK(std::isnan(worstRatio(rowOf({1.5, nan, 1}), unit)));
    CHECK(std::isnan(worstRatio(rowOf({nan, 1.5, 1}), unit)));
    CHECK(std::isnan(worstRatio(rowOf({1, 1.5, nan}), unit)));
    // Nothing over nothing: black where the unit is black says nothing.
    CHECK(std::isnan(worstRatio(rowOf({0, 1, 1}), rowOf({0, 1, 1}))));
    CHECK(std::isinf(worstRatio(rowOf({1, 1, 1}), rowOf({1, 0, 1}))));
}

TEST_CASE("form factors agree by two formulas, and with published values", "[verify]") {
    for (const double x : {0.0, 0.3, 1.0, 2.0, 20.0})
        CHECK(squareFormFactor(x, 0.5) ==
              Approx(polygonFormFactor({x, 0, 0}, {0, 1, 0},
                                       {{-.5, 1, -.5}, {.5, 1, -.5}, {.5, 1, .5}, {-.5, 1, .5}}))
                  .epsilon(1e-9));
    CHECK(squareFormFactor(0, 0.5) == Approx(.2394564705).epsilon(1e-9));
    CHECK(squareFormFactor(20, 0.5) == Approx(1.982807681e-6).epsilon(1e-8));
    CHECK(squareFormFactor(0, 5e-5) == Approx(3.18309885123e-9).epsilon(1e-10));
    // Two rectangles with a common edge: Howell's C-14 against the mean of Lambert's formula over one of
    // them.
    CHECK(perpendicularFormFactor(1, 1) == Approx(.2000437761).epsilon(1e-9));
    for (const auto& [depth, height] : {std::pair{1.0, 1.0}, {0.25, 2.0}, {2.0, 0.5}}) {
        const std::vector<Vec3d> wall{{-.5, 0, 0}, {.5, 0, 0}, {.5, height, 0}, {-.5, height, 0}};
        const double sum = rectangleIntegral(
            [&](double x, double s) {
                return 2 * s * polygonFormFactor({x, 0, s * s}, {0, 1, 0}, wall);
            },
            -.5, .5, 0, std::sqrt(depth), 8);
        CHECK(perpendicularFormFactor(depth, height) == Approx(sum / depth).epsilon(1e-5));
    }
    // The part of a wall below the horizon does not count: half of an upright square that straddles it.
    CHECK(polygonFormFactor({0, 0, 0}, {0, 1, 0}, {{1, -1, -1}, {1, 1, -1}, {1, 1, 1}, {1, -1, 1}}) ==
          Approx(polygonFormFactor({0, 0, 0}, {0, 1, 0}, {{1, 0, -1}, {1, 1, -1}, {1, 1, 1}, {1, 0, 1}}))
              .epsilon(1e-12));
    CHECK(fresnelDielectric(1, 1.5) == Approx(0.04).epsilon(1e-12));
    CHECK(fresnelDielectric(0.5, 1.5) == Approx(0.089186713).epsilon(1e-8));
    CHECK(fresnelDielectric(0.5, 1 / 1.5) == 1);
    CHECK(planck_W_m3_sr(550, 5778) == Approx(2.5857643e13).epsilon(1e-7));
}
