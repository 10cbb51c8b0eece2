#include "verify/context.h"

#include "base/error.h"
#include "verify/physics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

namespace crt::verify {
namespace {

stats::Interval meanOf(const std::vector<double>& replicates) {
    return stats::meanInterval(stats::summarize(replicates), kConfidence);
}

stats::Interval relativeTo(double expected, const stats::Interval& i) {
    return {i.lower - expected, i.upper - expected};
}

Verdict verdictOf(stats::Verdict verdict) {
    switch (verdict) {
        case stats::Verdict::Pass: return Verdict::Pass;
        case stats::Verdict::Fail: return Verdict::Fail;
        case stats::Verdict::Inconclusive: break;
    }
    return Verdict::Inconclusive;
}

/// The verdict on an interval that should lie within ±delta · |expected| of what is expected.
Verdict equivalenceOf(const stats::Interval& interval, double expected, double delta) {
    return verdictOf(stats::equivalence(relativeTo(expected, interval), delta * std::abs(expected)));
}

std::string tolerancePercent(double delta) { return fmt::format("± {:g} %, 99.9 % interval", 100 * delta); }

Outcome equivalenceOutcome(const std::string& what, const std::vector<double>& replicates, double expected,
                           double delta, const std::vector<Mistake>& mistakes) {
    const stats::Interval interval = meanOf(replicates);
    Outcome o;
    o.what = what;
    o.measured = interval.center();
    o.expected = expected;
    o.interval = interval;
    o.tolerance = tolerancePercent(delta);
    o.verdict = equivalenceOf(interval, expected, delta);
    if (o.verdict == Verdict::Fail)
        o.physics = diagnose(interval.center(), expected, interval.halfWidth(), mistakes);
    if (o.verdict == Verdict::Inconclusive)
        o.physics = fmt::format(
            "the interval is ± {:.3g} % wide: the noise is larger than the budget of samples allows for",
            100 * interval.halfWidth() / std::abs(expected));
    return o;
}

/// By what an estimate multiplies its samples: by 2 where that will tell, even if the intervals narrow no
/// faster than independent samples make them, otherwise by 4.
std::uint64_t growthFor(std::span<const Outcome> outcomes, double delta) {
    const auto remainsOpen = [delta](const Outcome& o) {
        if (o.verdict != Verdict::Inconclusive) return false;
        const double half_width = o.interval->halfWidth() / std::numbers::sqrt2;
        const stats::Interval narrowed{*o.measured - half_width, *o.measured + half_width};
        return equivalenceOf(narrowed, *o.expected, delta) == Verdict::Inconclusive;
    };
    return std::any_of(outcomes.begin(), outcomes.end(), remainsOpen) ? 4 : 2;
}

/// Differing pixels, as the floats that are written.
std::uint64_t differingPixels(const Film& a, const Film& b) {
    std::uint64_t differing = 0;
    for (std::uint32_t y = 0; y < a.shape().height; ++y)
        for (std::uint32_t x = 0; x < a.shape().width; ++x) {
            const std::size_t pixel = static_cast<std::size_t>(y) * a.shape().width + x;
            bool same = a.counts[pixel] == b.counts[pixel] &&
                        (a.primitives.empty() || a.primitives[pixel] == b.primitives[pixel]);
            for (std::uint32_t c = 0; c < a.shape().channels; ++c)
                same = same && static_cast<float>(a.mean(x, y, c)) == static_cast<float>(b.mean(x, y, c));
            for (std::size_t w = 0, words = a.shape().splatWords(); w < words; ++w)
                same = same && a.splats[pixel * words + w] == b.splats[pixel * words + w];
            differing += same ? 0 : 1;
        }
    return differing;
}

}  // namespace

Context::Context(const LoadedBackend& backend, const IntegratorOptions& options, Level level, Watch& watch)
    : backend_(backend), options_(options), level_(level), watch_(watch) {}

void Context::stopIfAsked() const {
    if (const std::optional<StopRequest> request = watch_.stopRequested()) throw Stopped{*request};
}

Scene Context::scene(const std::string& yaml, const std::vector<SceneOverride>& overrides) const {
    return parseScene(yaml, "case.yaml", ".", overrides);
}

Session& Context::sessionFor(const Render& how) {
    const bool usual = how.kernel == CRT_KERNEL_LEAN && how.threads == 0 && how.tile_size == 0;
    if (usual && usual_) return *usual_;
    IntegratorOptions options = options_;
    if (how.kernel != CRT_KERNEL_LEAN) options.kernel = how.kernel;
    if (how.threads != 0) options.threads = how.threads;
    options.tile_size = how.tile_size;
    // One at a time: a limit of threads holds for the process while its integrator lives.
    usual_.reset();
    unusual_.reset();
    std::unique_ptr<Session>& place = usual ? usual_ : unusual_;
    place = std::make_unique<Session>(backend_, options);
    return *place;
}

Film Context::render(const std::string& yaml, const Render& how) { return render(scene(yaml), how); }

Film Context::render(const Scene& what, const Render& how) {
    Film film = renderRaw(what, how);
    if (const std::uint64_t invalid = film.invalidSamples(); invalid > 0)
        holds("every sample is finite", false, "0 samples",
              "a division by zero, or a square root of a negative number, on the way",
              fmt::format("{} samples were NaN or infinite", invalid));
    return film;
}

Film Context::renderRaw(const Scene& original, const Render& how) {
    Scene changed;
    const Scene* what = &original;
    if (how.squares || (how.seed && *how.seed != original.sampler.seed)) {
        changed = original;
        if (how.seed) changed.sampler.seed = *how.seed;
        if (how.squares) changed.sampler.replicates = 1;
        what = &changed;
    }
    stopIfAsked();
    Session& session = sessionFor(how);
    Film film = renderFilm(session, *what,
                           {.samples = how.samples, .first_sample = how.first_sample, .aovs = how.aovs},
                           [this](double) { stopIfAsked(); });
    report_ = session.report();
    return film;
}

void Context::relative(const std::string& what, double measured, double expected, double tolerance,
                       const std::vector<Mistake>& mistakes) {
    Outcome o;
    o.what = what;
    o.measured = measured;
    o.expected = expected;
    o.tolerance = expected == 0 ? "exactly" : fmt::format("{:g} relative", tolerance);
    o.verdict =
        std::abs(measured - expected) <= tolerance * std::abs(expected) ? Verdict::Pass : Verdict::Fail;
    if (o.verdict == Verdict::Fail) o.physics = diagnose(measured, expected, 0, mistakes);
    add(std::move(o));
}

void Context::absolute(const std::string& what, double measured, double expected, double tolerance,
                       const std::vector<Mistake>& mistakes) {
    Outcome o;
    o.what = what;
    o.measured = measured;
    o.expected = expected;
    o.tolerance = fmt::format("± {:g}", tolerance);
    o.verdict = std::abs(measured - expected) <= tolerance ? Verdict::Pass : Verdict::Fail;
    if (o.verdict == Verdict::Fail) o.physics = diagnose(measured, expected, tolerance, mistakes);
    add(std::move(o));
}

void Context::equivalent(const std::string& what, const std::vector<double>& replicates, double expected,
                         double delta, const std::vector<Mistake>& mistakes) {
    add(equivalenceOutcome(what, replicates, expected, delta, mistakes));
}

void Context::equivalent(const std::string& what,
                         const std::function<std::vector<double>(std::uint64_t)>& replicatesOf,
                         double expected, double delta, const Effort& effort) {
    for (std::uint64_t samples = effort.samples;;) {
        Outcome outcome = equivalenceOutcome(what, replicatesOf(samples), expected, delta, {});
        if (outcome.verdict != Verdict::Inconclusive || samples >= effort.most)
            return add(std::move(outcome));
        samples = std::min(growthFor({&outcome, 1}, delta) * samples, effort.most);
    }
}

std::vector<Outcome> Context::estimated(const std::vector<Quantity>& quantities,
                                        const std::vector<std::string>& scenes, double delta,
                                        const Effort& effort, const std::vector<Mistake>& mistakes) {
    std::vector<Scene> parsed;
    for (const std::string& text : scenes) {
        parsed.push_back(scene(text));
        // The error comes from the spread over seeds. Replicates within the film would only cost the samples
        // their stratification.
        if (parsed.back().sampler.replicates == 0) parsed.back().sampler.replicates = 1;
    }
    const auto seeds = static_cast<std::size_t>(effort.seeds);
    std::vector<std::vector<Film>> films(seeds);
    for (std::uint64_t there = 0, wanted = effort.samples;;) {
        for (std::size_t i = 0; i < seeds; ++i)
            for (std::size_t k = 0; k < parsed.size(); ++k) {
                Film more =
                    render(parsed[k], {.samples = wanted - there, .first_sample = there, .seed = 1 + i});
                if (there == 0)
                    films[i].push_back(std::move(more));
                else
                    films[i][k].add(more);
            }
        there = wanted;
        std::vector<Outcome> outcomes;
        for (const Quantity& quantity : quantities) {
            std::vector<double> replicates;
            for (const std::vector<Film>& of_seed : films) replicates.push_back(quantity.measure(of_seed));
            outcomes.push_back(
                equivalenceOutcome(quantity.what, replicates, quantity.expected, delta, mistakes));
            outcomes.back().note = fmt::format("{} seeds × {} samples a pixel", seeds, there);
        }
        const bool told = std::none_of(outcomes.begin(), outcomes.end(),
                                       [](const Outcome& o) { return o.verdict == Verdict::Inconclusive; });
        if (told || wanted >= effort.most) return outcomes;
        wanted = std::min(growthFor(outcomes, delta) * wanted, effort.most);
    }
}

void Context::estimate(const std::vector<Quantity>& quantities, const std::vector<std::string>& scenes,
                       double delta, const Effort& effort, const std::vector<Mistake>& mistakes) {
    for (Outcome& outcome : estimated(quantities, scenes, delta, effort, mistakes)) add(std::move(outcome));
}

void Context::estimate(const std::string& what, const std::vector<std::string>& scenes,
                       const JointMeasure& measure, double expected, double delta, const Effort& effort,
                       const std::vector<Mistake>& mistakes) {
    estimate({{what, measure, expected}}, scenes, delta, effort, mistakes);
}

void Context::estimate(const std::string& what, const std::string& yaml, const Measure& measure,
                       double expected, double delta, const Effort& effort,
                       const std::vector<Mistake>& mistakes) {
    estimate(
        what, std::vector{yaml}, [&](const std::vector<Film>& films) { return measure(films.front()); },
        expected, delta, effort, mistakes);
}

void Context::rate(const std::string& what, std::uint64_t failures, std::uint64_t trials, double bound,
                   const std::string& physics) {
    Outcome o;
    o.what = what;
    const stats::Interval interval = stats::clopperPearson(failures, trials, kConfidence);
    o.measured = static_cast<double>(failures) / static_cast<double>(trials);
    o.expected = 0;
    o.interval = interval;
    o.tolerance = fmt::format("rate ≤ {:g}, 99.9 % interval", bound);
    o.note = fmt::format("{} of {}", failures, trials);
    o.verdict = interval.upper <= bound ? Verdict::Pass
                                        : (interval.lower > bound ? Verdict::Fail : Verdict::Inconclusive);
    if (failed(o.verdict)) o.physics = physics;
    add(std::move(o));
}

void Context::sameBits(const std::string& what, const Film& a, const Film& b, const std::string& physics) {
    const bool comparable = a.shape() == b.shape();
    const std::uint64_t differing = comparable ? differingPixels(a, b) : 0;
    holds(what, comparable && differing == 0, "same bits", physics,
          comparable ? fmt::format("{} of {} pixels differ", differing, a.counts.size())
                     : std::string("films of different shapes"));
}

void Context::holds(const std::string& what, bool true_, const std::string& tolerance,
                    const std::string& physics, const std::string& note) {
    Outcome o;
    o.what = what;
    o.verdict = true_ ? Verdict::Pass : Verdict::Fail;
    o.tolerance = tolerance;
    o.note = note;
    if (!true_) o.physics = physics;
    add(std::move(o));
}

void Context::notApplicable(const std::string& what, const std::string& reason) {
    Outcome o;
    o.what = what;
    o.verdict = Verdict::NotApplicable;
    o.note = reason;
    add(std::move(o));
}

void Context::add(Outcome outcome) { outcomes_.push_back(std::move(outcome)); }

std::vector<Outcome> Context::take() { return std::exchange(outcomes_, {}); }

double radiance(const Film& film, std::uint32_t x, std::uint32_t y) {
    static const double unit = [] {
        const Vec3d xyz = spectrumToXyz(constantSpectrum(1));
        return xyz[0] + xyz[1] + xyz[2];
    }();
    return (film.mean(x, y, 0) + film.mean(x, y, 1) + film.mean(x, y, 2)) / unit;
}

namespace {

template <class OfPixel>
double meanOver(const Film& film, OfPixel ofPixel) {
    double sum = 0;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) sum += ofPixel(x, y);
    return sum / (static_cast<double>(film.shape().width) * film.shape().height);
}

}  // namespace

double radiance(const Film& film) {
    return meanOver(film, [&](std::uint32_t x, std::uint32_t y) { return radiance(film, x, y); });
}

double meanOfBin(const Film& film, std::uint32_t bin) {
    double sum = 0;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x)
            sum += film.mean(x, y, film.shape().firstSpectral() + bin);
    return sum / (film.shape().width * film.shape().height);
}

double fartherFrom(double target, double a, double b) {
    return std::isnan(a) || std::abs(a - target) > std::abs(b - target) ? a : b;
}

double worstRatio(const Film& film, const Film& unit, double factor) {
    double worst = 1;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x)
            worst = fartherFrom(1, worst, film.mean(x, y, 1) / unit.mean(x, y, 1) / factor);
    return worst;
}

double pathVariance(const Film& film, std::uint32_t x, std::uint32_t y) {
    const std::uint32_t squares = firstChannel(film.shape().aovs, kAovSquares);
    if (squares == 0)
        throw Error(ErrorKind::Internal, "the variance of paths is asked of a film without squares");
    const double mean = film.mean(x, y, 1);
    return film.mean(x, y, squares) - mean * mean;
}

double pathVariance(const Film& film) {
    return meanOver(film, [&](std::uint32_t x, std::uint32_t y) { return pathVariance(film, x, y); });
}

Vec3d meanXyz(const Film& film) {
    Vec3d xyz;
    for (std::uint32_t c = 0; c < 3; ++c)
        xyz[c] = meanOver(film, [&](std::uint32_t x, std::uint32_t y) { return film.mean(x, y, c); });
    return xyz;
}

double luminance(const Film& film) {
    return meanOver(film, [&](std::uint32_t x, std::uint32_t y) { return film.mean(x, y, 1); });
}

}  // namespace crt::verify
