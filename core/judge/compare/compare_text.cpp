#include "judge/compare/compare_text.h"

#include "base/statistics.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace crt {
namespace {

using Json =
    nlohmann::ordered_json;  // The library writes infinities and NaN as null, which JSON has no numbers for.

std::string number(double v) { return fmt::format("{:.6g}", v); }
std::string percent(double fraction) { return fmt::format("{:.3g} %", 100 * fraction); }

/// "\n  name              value"
class Lines {
public:
    explicit Lines(std::string first) : text_(std::move(first)) {}
    void add(const char* name, const std::string& value) {
        text_ += fmt::format("\n  {:<18}{}", name, value);
    }
    void heading(const std::string& sentence) { text_ += "\n" + sentence; }
    const std::string& text() const { return text_; }

private:
    std::string text_;
};

const char* verdictOf(const CompareResult& r) {
    if (!r.same && r.differing_pixels == 0)
        return "not the same within a tolerance, since values are not finite";
    return r.same ? (r.differing_pixels == 0 ? "same bits" : "same within the tolerance") : "different";
}

std::string differenceText(const Difference& d) {
    std::string text =
        fmt::format("pixel {},{} channel {}: {:.9g} and {:.9g}", d.x, d.y, d.channel, d.first, d.second);
    if (d.ulps) text += fmt::format(" ({} ulp)", *d.ulps);
    return text;
}

void addMetricLines(Lines& lines, const CompareResult& r) {
    lines.add("largest", fmt::format("{} absolute, {} ulp; 99 % of the values are within {}",
                                     number(r.max_absolute), r.max_ulp, number(r.p99_absolute)));
    if (r.relative_rmse)
        lines.add("error",
                  fmt::format("{} (RMSE of luminance, over B's mean luminance)", percent(*r.relative_rmse)));
    lines.add("RMSE", fmt::format("{} ({} of the mean{}), MSE {}", number(r.rmse), number(r.rmse_over_mean),
                                  r.tolerance > 0 ? fmt::format(", {} allowed", number(r.tolerance)) : "",
                                  number(r.mse)));
    lines.add("relMSE", number(r.relmse));
    lines.add("MAE", number(r.mae));
    lines.add("SMAPE", number(r.smape));
    lines.add("mean",
              fmt::format("{} and {}, ratio {:.9g}", number(r.mean[0]), number(r.mean[1]), r.mean_ratio));
    if (!r.perceived) return;
    const PerceivedDifference& l = *r.perceived;
    lines.add(l.high_range ? "HDR-FLIP" : "LDR-FLIP",
              std::isnan(l.flip_mean) ? "undefined: B is black"
                                      : number(l.flip_mean) + " (0 looks the same, 1 is the most)");
    lines.add("Delta E 2000", fmt::format("mean {:.3g}, largest {:.3g} (about 1 can just be seen)",
                                          l.delta_e_mean, l.delta_e_max));
}

// ---------------------------------------------------------------------------------------------------- noise

std::string familyText(const stats::TestFamily& family, const char* method, const std::string& worst) {
    return fmt::format("{} of {} tests differ beyond noise (smallest p {:.2g} {}{})", family.rejected,
                       family.tests, family.smallest_p, method, family.rejected > 0 ? ", " + worst : "");
}

/// For images that state only the noise of luminance.
void addColourLine(Lines& lines, const NoiseComparison& noise) {
    if (!noise.colour_unjudged.empty())
        lines.add("colour", "luminance only; colour is not judged: " + noise.colour_unjudged);
    if (noise.colours.empty()) return;
    const auto most = std::min_element(noise.colours.begin(), noise.colours.end(),
                                       [](const auto& a, const auto& b) { return a.p < b.p; });
    lines.add("colour",
              fmt::format("at equal luminance {} differs by {:+.3g} % of the mean (p {:.2g}, by the "
                          "signs of the pixels' differences): {}",
                          most->channel, 100 * most->relative, most->p,
                          noise.beyondNoise(*most) ? "more than noise" : "may be noise"));
}

void addNoiseLines(Lines& lines, const NoiseComparison& noise, std::uint32_t width) {
    if (!noise.unknown.empty()) {
        lines.heading("Noise or bias? Not known: " + noise.unknown + ".");
        return;
    }
    const auto source = [](const std::string& from) {
        return from.empty() ? std::string("none known, taken as exact") : from;
    };
    lines.heading(noise.stated
                      ? "Noise or bias? By the images' own noise:"
                      : "Noise or bias? Neither image states its noise, so by the signs of the pixels' "
                        "differences, which are equally often positive and negative if only the seeds "
                        "differ:");
    lines.add("noise of A", source(noise.source_a));
    lines.add("noise of B", source(noise.source_b));
    for (const ChannelBias& c : noise.channels) {
        const bool relative = c.mean_b != 0;  // Nothing is relative to black.
        const double scale = relative ? 100 / std::abs(c.mean_b) : 1;
        const char* unit = relative ? " %" : "";
        lines.add(
            ("bias " + c.channel).c_str(),
            std::isinf(c.interval.upper)
                ? fmt::format("{:+.3g}{}: not judged, too few pixels differ", scale * c.difference, unit)
                : fmt::format("{:+.3g}{}, {:g} % interval [{:+.3g}, {:+.3g}]{}: {}", scale * c.difference,
                              unit, 100 * noise.confidence, scale * c.interval.lower,
                              scale * c.interval.upper, unit,
                              c.beyondNoise() ? "more than noise" : "may be noise"));
    }
    addColourLine(lines, noise);
    const std::size_t channels = noise.channels.size();
    const auto at = [&](std::size_t place, std::uint32_t across, std::uint32_t side) {
        return fmt::format("at {},{}", place / channels % across * side, place / channels / across * side);
    };
    lines.add("tiles of 8x8", familyText(noise.tiles, "after Holm",
                                         at(noise.tiles.worst, noise.tiles_across, stats::kTileSide)));
    lines.add("pixels", noise.pixels_untested.empty()
                            ? familyText(noise.pixels, "after Sidak", at(noise.pixels.worst, width, 1))
                            : "not tested: " + noise.pixels_untested);
    if (noise.stated)
        lines.add("rms z",
                  fmt::format("{:.3g} (1: the difference is only noise, of the size that the images state; "
                              "p {:.2g}): {}",
                              noise.rms_z, noise.rms_z_p,
                              noise.rmsBeyondNoise() ? "more than noise" : "may be noise"));
    lines.add("result", noise.anyBeyondNoise() ? "the images differ by more than noise"
                                               : "no difference beyond noise was found");
}

Json familyJson(const stats::TestFamily& family) {
    return {{"tests", family.tests},
            {"rejected", family.rejected},
            {"smallest_adjusted_p", family.smallest_p},
            {"alpha", family.alpha}};
}

Json noiseJson(const NoiseComparison& noise) {
    if (!noise.unknown.empty()) return {{"unknown", noise.unknown}};
    Json json{{"source_a", noise.source_a},
              {"source_b", noise.source_b},
              {"confidence", noise.confidence},
              {"bias", Json::array()}};
    for (const ChannelBias& c : noise.channels)
        json["bias"].push_back({{"channel", c.channel},
                                {"mean", {c.mean_a, c.mean_b}},
                                {"difference", c.difference},
                                {"interval", {c.interval.lower, c.interval.upper}},
                                {"p", c.p},
                                {"beyond_noise", c.beyondNoise()}});
    json["tiles"] = familyJson(noise.tiles);
    json["pixels"] =
        noise.pixels_untested.empty() ? familyJson(noise.pixels) : Json{{"untested", noise.pixels_untested}};
    json["rms_z"] = noise.stated ? Json(noise.rms_z) : Json(nullptr);
    json["rms_z_p"] = noise.stated ? Json(noise.rms_z_p) : Json(nullptr);
    json["rms_z_beyond_noise"] = noise.rmsBeyondNoise();
    json["colour"] = Json::array();
    for (const ColourShift& c : noise.colours)
        json["colour"].push_back({{"channel", c.channel},
                                  {"relative_shift", c.relative},
                                  {"p", c.p},
                                  {"beyond_noise", noise.beyondNoise(c)}});
    json["colour_unjudged"] = noise.colour_unjudged.empty() ? Json(nullptr) : Json(noise.colour_unjudged);
    return json;
}

// ------------------------------------------------------------------------------------------------ reference

struct ReferenceRow {
    const char *name, *key;
    SpreadMetric ReferenceError::*metric;
};
constexpr std::array<ReferenceRow, 12> kRows{
    {{"error", "relative_rmse", &ReferenceError::relative_rmse},
     {"RMSE", "rmse", &ReferenceError::rmse},
     {"RMSE / mean", "rmse_over_mean", &ReferenceError::rmse_over_mean},
     {"relMSE", "relmse", &ReferenceError::relmse},
     {"SMAPE", "smape", &ReferenceError::smape},
     {"MAE", "mae", &ReferenceError::mae},
     {"99th percentile", "p99_absolute", &ReferenceError::p99_absolute},
     {"largest", "max_absolute", &ReferenceError::max_absolute},
     {"mean / mean R", "mean_ratio", &ReferenceError::mean_ratio},
     {"FLIP", "flip", &ReferenceError::flip},
     {"Delta E, mean", "delta_e_2000_mean", &ReferenceError::delta_e_mean},
     {"Delta E, largest", "delta_e_2000_max", &ReferenceError::delta_e_max}}};

std::string spreadText(const SpreadMetric& m) {
    return m.spread ? fmt::format("{:.5g} ±{:.1g}", m.value, *m.spread) : fmt::format("{:.5g}", m.value);
}

std::string cell(const std::string& text, std::size_t columns) {
    std::size_t shown = 0;
    for (const char c : text)
        shown += (static_cast<unsigned char>(c) & 0xc0) != 0x80;  // UTF-8: ± is one column and two bytes.
    return text + std::string(columns > shown ? columns - shown : 1, ' ');
}

/// A void or undefined ratio has no number: 0/0 is none.
std::string ratioText(double a, double b) { return std::isnan(a / b) ? "-" : fmt::format("{:.3g}", a / b); }

std::string correctedText(const ReferenceError& e) {
    if (!e.metrics.valid()) return "void";
    if (e.corrected_relative_rmse) return fmt::format("{:.5g}", *e.corrected_relative_rmse);
    return e.within_reference_noise ? "below R's noise" : "R's noise unknown";
}

void addReferenceLines(Lines& lines, const ReferenceComparison& r) {
    constexpr std::size_t kColumn = 24;
    lines.heading("Against the reference R:");
    for (std::size_t i = 0; i < 2; ++i) {
        const ReferenceError& e = r.errors[i];
        if (!e.metrics.valid())
            lines.add(i == 0 ? "A" : "B", fmt::format("void: {} values are not finite, {} in the reference",
                                                      e.metrics.test.total(), e.metrics.reference.total()));
        for (const std::string& warning : e.warnings)
            lines.add(i == 0 ? "WARNING, A" : "WARNING, B", warning);
    }
    for (const std::string& note : r.notes) lines.add("note", note);
    lines.add("", cell("A", kColumn) + cell("B", kColumn) + "A / B");
    for (const ReferenceRow& row : kRows) {
        const SpreadMetric &a = r.errors[0].*row.metric, &b = r.errors[1].*row.metric;
        lines.add(row.name,
                  cell(spreadText(a), kColumn) + cell(spreadText(b), kColumn) + ratioText(a.value, b.value));
        if (row.metric != &ReferenceError::relative_rmse) continue;
        lines.add(
            "  less R's noise",
            cell(correctedText(r.errors[0]), kColumn) + cell(correctedText(r.errors[1]), kColumn) +
                (r.errors[0].corrected_relative_rmse && r.errors[1].corrected_relative_rmse
                     ? ratioText(*r.errors[0].corrected_relative_rmse, *r.errors[1].corrected_relative_rmse)
                     : "-"));
    }
    lines.heading(
        "  \"error\" is the RMSE of luminance over R's mean luminance; rows below it are of R, G and B.");
    if (r.reference_rms_error) {
        lines.heading(
            fmt::format("  R's own error is {} ({}); \"less R's noise\" has its variance subtracted.",
                        percent(*r.reference_rms_error), r.reference_noise_source));
    } else {
        lines.heading(
            "  R does not state its own noise, so all errors include it (`crt reference` makes references "
            "that state it).");
    }
    if (r.errors[0].rmse.spread)
        lines.heading(
            "  ± is the standard error due to the reference, by a jackknife over its eight parts.");
}

Json referenceJson(const ReferenceComparison& r) {
    Json json{{"reference_relative_rms_error",
               r.reference_rms_error ? Json(*r.reference_rms_error) : Json(nullptr)},
              {"reference_noise_source", r.reference_noise_source},
              {"notes", r.notes}};
    for (std::size_t i = 0; i < 2; ++i) {
        const ReferenceError& e = r.errors[i];
        Json& of = json[i == 0 ? "a" : "b"];
        of["valid"] = e.metrics.valid();
        of["mse"] = e.metrics.mse;
        for (const ReferenceRow& row : kRows) {
            of[row.key] = (e.*row.metric).value;
            of[std::string(row.key) + "_spread"] =
                (e.*row.metric).spread ? Json(*(e.*row.metric).spread) : Json(nullptr);
        }
        of["relative_rmse_less_reference_variance"] =
            e.corrected_relative_rmse ? Json(*e.corrected_relative_rmse) : Json(nullptr);
        of["within_reference_noise"] = e.within_reference_noise;
        of["warnings"] = e.warnings;
    }
    return json;
}

Json resultJson(const CompareResult& r) {
    Json json;
    json["same"] = r.same;
    json["tolerance"] = r.tolerance;
    json["mismatch"] = r.mismatch.empty() ? Json(nullptr) : Json(r.mismatch);
    json["notes"] = r.notes;
    if (!r.mismatch.empty()) return json;
    json["width"] = r.width;
    json["height"] = r.height;
    json["channels"] = r.channels;
    json["other_channels"] = r.other_channels;
    json["differing_pixels"] = r.differing_pixels;
    json["first_difference"] = nullptr;
    if (r.first_difference) {
        const Difference& d = *r.first_difference;
        json["first_difference"] = {
            {"x", d.x}, {"y", d.y}, {"channel", d.channel}, {"first", d.first}, {"second", d.second}};
        json["first_difference"]["ulps"] = d.ulps ? Json(*d.ulps) : Json(nullptr);
    }
    json["not_finite"] = r.not_finite;
    json["metrics"] = nullptr;
    if (!r.metrics_valid) return json;
    json["metrics"] = Json{{"max_absolute", r.max_absolute},
                           {"max_ulp", r.max_ulp},
                           {"p99_absolute", r.p99_absolute},
                           {"mse", r.mse},
                           {"rmse", r.rmse},
                           {"relative_rmse", r.relative_rmse ? Json(*r.relative_rmse) : Json(nullptr)},
                           {"rmse_over_mean", r.rmse_over_mean},
                           {"relmse", r.relmse},
                           {"mae", r.mae},
                           {"smape", r.smape},
                           {"mean", r.mean},
                           {"mean_ratio", r.mean_ratio}};
    if (r.perceived) {
        json["metrics"]["flip"] = r.perceived->flip_mean;
        json["metrics"]["flip_kind"] = r.perceived->high_range ? "HDR" : "LDR";
        json["metrics"]["delta_e_2000_mean"] = r.perceived->delta_e_mean;
        json["metrics"]["delta_e_2000_max"] = r.perceived->delta_e_max;
    }
    return json;
}

Lines resultLines(const CompareResult& r) {
    if (!r.mismatch.empty()) return Lines("different: " + r.mismatch);
    const std::uint64_t pixels = std::uint64_t{r.width} * r.height;
    Lines lines(fmt::format("{}: {} of {} pixels differ ({})", verdictOf(r), r.differing_pixels, pixels,
                            fmt::join(r.channels, ", ")));
    if (r.first_difference) lines.add("first difference", differenceText(*r.first_difference));
    if (!r.metrics_valid) {
        lines.add("not finite",
                  fmt::format("{} values in the first image, {} in the second: all metrics are meaningless",
                              r.not_finite[0], r.not_finite[1]));
    } else if (r.differing_pixels > 0) {
        addMetricLines(lines, r);
    }
    for (const std::string& note : r.notes) lines.add("note", note);
    if (!r.other_channels.empty())
        lines.add("not compared", fmt::format("{} (in one image only)", fmt::join(r.other_channels, ", ")));
    return lines;
}

}  // namespace

std::string compareText(const CompareResult& result) { return resultLines(result).text(); }
std::string compareJson(const CompareResult& result) { return resultJson(result).dump(2); }

std::string comparisonText(const Comparison& comparison) {
    const CompareResult& r = *comparison.result;
    Lines lines = resultLines(r);
    if (comparison.noise != nullptr && r.differing_pixels > 0)
        addNoiseLines(lines, *comparison.noise, r.width);
    if (comparison.reference != nullptr) addReferenceLines(lines, *comparison.reference);
    return lines.text();
}

std::string comparisonJson(const Comparison& comparison) {
    Json json = resultJson(*comparison.result);
    if (comparison.noise != nullptr) json["noise"] = noiseJson(*comparison.noise);
    if (comparison.reference != nullptr) json["reference"] = referenceJson(*comparison.reference);
    return json.dump(2);
}

}  // namespace crt
