// Does the error that an image states of itself hold? One JSON object a line; bench/run calibration makes a
// page of them.
//
//     error_calibration stated BACKEND SCENE SIDE SAMPLER SEEDS
//         the stated error against the real one, at many numbers of samples
//     error_calibration price BACKEND SCENE SIDE SAMPLER SEEDS
//         the error of an image with replicates, and of one sequence
//
// SCENE is a file, rendered at SIDE x SIDE pixels. SAMPLER: sobol or independent. The real error is the
// spread between seeds.
#include "backend/integrator.h"
#include "backend/loader.h"
#include "base/log.h"
#include "base/statistics.h"
#include "film/error_estimate.h"
#include "film/pooled_variance.h"
#include "render/brightest_path.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <string>
#include <vector>

using namespace crt;

namespace {

/// Powers of two, one more, and numbers that a time limit or Ctrl-C might leave.
constexpr std::uint64_t kSamples[] = {16, 32, 33, 64, 100, 128, 256, 300, 512, 1000, 1024};
/// Targets of --target-error, as multiples of the real error at the last of these.
constexpr double kTargets[] = {0.6, 0.7, 0.8, 0.9, 1, 1.1, 1.2, 1.3};

constexpr double kNever = std::numeric_limits<double>::infinity();

struct Setup {
    Integrator* integrator;
    std::string file, sampler;
    int side;

    Scene scene(std::uint64_t seed, bool replicates = true) const {
        std::vector<SceneOverride> settings{{"film.resolution", fmt::format("[{0},{0}]", side)},
                                            {"sampler.type", sampler},
                                            {"sampler.seed", fmt::format("{}", seed)}};
        if (!replicates) settings.push_back({"sampler.replicates", "1"});
        return loadScene(file, settings);
    }
    bool independent() const { return sampler != "sobol"; }
};

/// Samples of one scene with one seed, range after range, on a device that is opened once.
class Progressive {
public:
    Progressive(const Setup& setup, const Scene& scene)
        : integrator_(*setup.integrator), compiled_(compileScene(scene, 0)) {
        restart();
    }

    void render(SampleRange range) {
        integrator_.render({.first_sample = range.first, .sample_count = range.second - range.first});
        ranges_.add(range);
    }
    Film film() {
        Film film(filmShapeOf(compiled_));
        integrator_.readFilm(film);
        film.samples = ranges_;
        return film;
    }
    BrightestPath brightestPath() const { return brightestPathOf(compiled_); }
    void restart() {
        integrator_.setScene(compiled_);
        ranges_ = {};
    }

private:
    Integrator& integrator_;
    CompiledScene compiled_;
    SampleRanges ranges_;
};

std::vector<double> luminanceOf(const Film& film) {
    std::vector<double> y;
    for (std::uint32_t j = 0; j < film.shape().height; ++j)
        for (std::uint32_t i = 0; i < film.shape().width; ++i) y.push_back(film.mean(i, j, 1));
    return y;
}

double meanOf(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return sum / static_cast<double>(values.size());
}

/// The results of all seeds with one number of samples.
class Images {
public:
    void add(const std::vector<double>& y) {
        if (sum_.empty()) sum_.resize(y.size()), squares_.resize(y.size());
        for (std::size_t i = 0; i < y.size(); ++i) {
            sum_[i] += y[i];
            squares_[i] += y[i] * y[i];
        }
        ++count_;
        images_.push_back(y);
    }
    double mean() const { return meanOf(sum_) / count_; }
    /// Root mean square error over the pixels, relative to the mean: the pixels' variances between seeds.
    double relativeRmse() const {
        double variance = 0;
        for (std::size_t i = 0; i < sum_.size(); ++i)
            variance += (squares_[i] - sum_[i] * sum_[i] / count_) / (count_ - 1);
        return std::sqrt(variance / static_cast<double>(sum_.size())) / mean();
    }
    /// Standard error of relativeRmse, relative to it: from the spread of the seeds' own squared errors.
    double relativeError() const {
        const double all = relativeRmse();
        double squares = 0;
        for (const std::vector<double>& y : images_) {
            double own = 0;
            for (std::size_t i = 0; i < y.size(); ++i)
                own += (y[i] - sum_[i] / count_) * (y[i] - sum_[i] / count_);
            own = own * count_ / (count_ - 1) / static_cast<double>(y.size()) / (mean() * mean());
            squares += (own / (all * all) - 1) * (own / (all * all) - 1);
        }
        return 0.5 * std::sqrt(squares / (count_ - 1) / count_);
    }
    const std::vector<std::vector<double>>& all() const { return images_; }
    const std::vector<double>& sum() const { return sum_; }
    double count() const { return count_; }

private:
    std::vector<double> sum_, squares_;
    std::vector<std::vector<double>> images_;
    double count_ = 0;
};

double relativeDistance(const std::vector<double>& a, const std::vector<double>& truth) {
    double squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) squares += (a[i] - truth[i]) * (a[i] - truth[i]);
    return std::sqrt(squares / static_cast<double>(a.size())) / meanOf(truth);
}

/// The error that one image states at one number of samples.
struct Statement {
    ErrorEstimate error;
    double stops_at = 0;               ///< The least target that --target-error would have reached.
    std::vector<double> pixel_errors;  ///< Standard errors of the pixels, as the image has them.
};

Statement statementOf(const Film& film, const PathFacts& paths) {
    Statement s;
    const auto estimate = [&](PixelSet which) { return estimateError(film, which, paths); };
    ErrorEstimate nothing;
    nothing.knowledge = ErrorKnowledge::NotYet;
    s.error = estimate(PixelSet::All).value_or(nothing);
    for (const PixelSet which : {PixelSet::All, PixelSet::Even, PixelSet::Odd}) {
        const std::optional<ErrorEstimate> e = estimate(which);
        s.stops_at = std::max(s.stops_at, e && e->known() ? e->half_width_95 : kNever);
    }
    const LuminanceVariance variance(film);
    const std::uint32_t width = film.shape().width, height = film.shape().height;
    std::vector<double> own;
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) own.push_back(variance(x, y));
    s.pixel_errors = stats::variancesWithoutZeros(
        stats::pooledVariances(own, width, height, variance.degreesOfFreedom()).variances, width, height);
    for (double& v : s.pixel_errors) v = std::sqrt(v);
    return s;
}

/// All seeds' images of one number of samples, and what they say.
struct Looks {
    Images images;
    std::vector<Statement> statements;

    /// The mean of the other seeds, and the factor by which its own error enlarges the distance to it.
    std::vector<double> others(std::size_t seed) const {
        std::vector<double> mean = images.sum();
        for (std::size_t k = 0; k < mean.size(); ++k)
            mean[k] = (mean[k] - images.all()[seed][k]) / (images.count() - 1);
        return mean;
    }
    double excess() const { return std::sqrt(1 + 1 / (images.count() - 1)); }
    double ownError(std::size_t seed) const {
        return relativeDistance(images.all()[seed], others(seed)) / excess();
    }
};

/// Root mean square of the pixels' deviations in units of what they state, and the share within 1.96: of
/// pixels that any seed's light reaches.
std::pair<double, double> pixelScores(const Looks& looks) {
    double squares = 0, within = 0, count = 0;
    for (std::size_t i = 0; i < looks.statements.size(); ++i) {
        const std::vector<double>&y = looks.images.all()[i], &stated = looks.statements[i].pixel_errors;
        const std::vector<double> truth = looks.others(i);
        for (std::size_t k = 0; k < y.size(); ++k) {
            if (y[k] == truth[k]) continue;
            const double z = std::abs(y[k] - truth[k]) / looks.excess() / stated[k];
            // A pixel is infinitely far off where neither it nor its neighbours met the light: it counts as
            // outside, and stays out of the mean.
            if (std::isfinite(z)) squares += z * z;
            within += z <= 1.96;
            count += 1;
        }
    }
    return {std::sqrt(squares / count), within / count};
}

void printLook(const std::string& name, const Looks& looks) {
    const double truth = looks.images.relativeRmse();
    int known = 0, covered = 0, within = 0, mean_covered = 0;
    double ratio = 0, squares = 0, dof = 0;
    for (std::size_t i = 0; i < looks.statements.size(); ++i) {
        const ErrorEstimate& e = looks.statements[i].error;
        dof += e.degrees_of_freedom / looks.images.count();
        squares += e.relative_rmse * e.relative_rmse / looks.images.count();
        if (!e.known()) continue;
        ++known;
        covered += e.relative_rmse_95.contains(truth);
        ratio += e.relative_rmse / truth;
        within += looks.ownError(i) <= e.half_width_95;
        const double mean = meanOf(looks.others(i)), seen = meanOf(looks.images.all()[i]);
        mean_covered += std::abs(seen - mean) / looks.excess() <= e.meanInterval(0.95).halfWidth();
    }
    const auto [z, z_within] = pixelScores(looks);
    fmt::print(
        "{{\"samples\": \"{}\", \"seeds\": {}, \"true\": {}, \"true_error\": {}, \"known\": {}, "
        "\"covered\": {}, \"within_half_width\": {}, \"mean_covered\": {}, \"ratio\": {}, "
        "\"ratio_of_all\": {}, \"degrees_of_freedom\": {}, \"pixel_z\": {}, \"pixels_within\": {}}}\n",
        name, looks.statements.size(), truth, looks.images.relativeError(), known, covered, within,
        mean_covered, known > 0 ? ratio / known : 0, std::sqrt(squares) / truth, dof, z, z_within);
}

/// The samples at which --target-error would have stopped, and the number of images that were worse than
/// their target. It looks when the number of samples is a power of two from 64 on, earlier than crt does
/// with so few pixels.
void printStops(const std::map<std::uint64_t, Looks>& looks) {
    const double real = looks.rbegin()->second.images.relativeRmse();
    for (const double target : kTargets) {
        int stopped = 0, wrong = 0;
        const std::size_t seeds = looks.begin()->second.statements.size();
        for (std::size_t i = 0; i < seeds; ++i)
            for (const auto& [samples, look] : looks) {
                if (samples < 64 || !std::has_single_bit(samples)) continue;
                if (look.statements[i].stops_at > target * real) continue;
                ++stopped;
                wrong += look.ownError(i) > target * real;
                break;
            }
        fmt::print("{{\"target\": {}, \"seeds\": {}, \"stopped\": {}, \"wrong\": {}}}\n", target, seeds,
                   stopped, wrong);
    }
}

void stated(const Setup& setup, std::uint64_t seeds) {
    std::map<std::uint64_t, Looks> looks;
    Looks merged;  // The film after a merge of two machines' unequal ranges.
    PathFacts paths{setup.independent(), {}};
    const auto look = [&](Looks& at, const Film& film) {
        at.images.add(luminanceOf(film));
        at.statements.push_back(statementOf(film, paths));
    };
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        Progressive progressive(setup, setup.scene(seed));
        if (seed == 1) paths.brightest = progressive.brightestPath();
        std::uint64_t there = 0;
        for (const std::uint64_t samples : kSamples) {
            progressive.render({there, samples});
            there = samples;
            look(looks[samples], progressive.film());
        }
        progressive.restart();
        progressive.render({0, 101});
        progressive.render({1000, 1233});
        look(merged, progressive.film());
    }
    for (const auto& [samples, at] : looks) printLook(fmt::format("{}", samples), at);
    printLook("101 + 233", merged);
    printStops(looks);
}

void price(const Setup& setup, std::uint64_t seeds) {
    std::map<std::uint64_t, Images> with, without;
    for (const bool replicates : {true, false})
        for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
            Progressive progressive(setup, setup.scene(seed + (replicates ? 0 : 5000), replicates));
            std::uint64_t there = 0;
            for (const std::uint64_t samples : {64, 100, 128, 256, 300, 512, 1024}) {
                progressive.render({there, samples});
                there = samples;
                (replicates ? with : without)[samples].add(luminanceOf(progressive.film()));
            }
        }
    for (const auto& [samples, images] : with)
        fmt::print(
            "{{\"samples\": {}, \"seeds\": {}, \"replicates\": {}, \"replicates_error\": {}, "
            "\"one_sequence\": {}, \"one_sequence_error\": {}}}\n",
            samples, seeds, images.relativeRmse(), images.relativeError(), without[samples].relativeRmse(),
            without[samples].relativeError());
}

}  // namespace

int main(int argc, char** argv) {
    const std::string mode = argc > 1 ? argv[1] : "";
    if (argc != 7 || (mode != "stated" && mode != "price")) {
        std::fprintf(stderr, "error_calibration stated|price BACKEND SCENE SIDE SAMPLER SEEDS\n");
        return 2;
    }
    const Listener listener(standardErrorSink(), LogLevel::Error);
    const ListenerScope scope(listener);
    try {
        Integrator integrator(loadBackend(argv[2]), {});
        const Setup setup{&integrator, argv[3], argv[5], std::stoi(argv[4])};
        const std::uint64_t seeds = std::stoull(argv[6]);
        if (mode == "stated")
            stated(setup, seeds);
        else
            price(setup, seeds);
        return 0;
    } catch (const Error& error) {
        std::fprintf(stderr, "error_calibration: %s\n", error.what());
        return error.exitCode();
    }
}
