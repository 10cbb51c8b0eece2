// Does the error that an image states of itself hold? One JSON object a line; bench/run calibration makes a
// page of them.
//
//     error_calibration stated BACKEND SCENE SIDE SAMPLER SEEDS
//         the stated error against the real one, at many numbers of samples
//     error_calibration price BACKEND SCENE SIDE SAMPLER SEEDS
//         the error of an image with replicates, and of one sequence
//     error_calibration stop BACKEND SCENE SIDE SAMPLER SEEDS TARGET MOST
//         what --target-error stops at
//
// SCENE is a file, rendered at SIDE x SIDE pixels. SAMPLER: sobol or independent. The real error is the
// spread between seeds; for `stop`, the distance from the mean of independent renders of MOST samples with
// other seeds.
#include "backend/integrator.h"
#include "backend/loader.h"
#include "base/log.h"
#include "base/statistics.h"
#include "film/error_estimate.h"
#include "render/sampling.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

using namespace crt;

namespace {

/// Powers of two, one more, and numbers that a time limit or Ctrl-C might leave.
constexpr std::uint64_t kSamples[] = {32, 33, 64, 65, 100, 129, 300, 513, 700, 1000, 1024};
constexpr std::uint64_t kReferenceSeed = 1'000'003;
constexpr int kReferenceRenders = 8;

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
        Film film({compiled_.width, compiled_.height, compiled_.channels, compiled_.aovs});
        integrator_.readFilm(film);
        film.samples = ranges_;
        return film;
    }
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

/// What one number of samples looked like in every seed.
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

void stated(const Setup& setup, std::uint64_t seeds) {
    // The last: what a merge of two machines' unequal ranges leaves.
    std::map<std::string, std::vector<SampleRange>> kinds;
    std::map<std::string, Images> images;
    std::map<std::string, std::vector<ErrorEstimate>> estimates;
    std::vector<std::string> order;
    ErrorEstimate nothing;
    nothing.knowledge = ErrorKnowledge::NotYet;
    const auto look = [&](const std::string& name, const Film& film) {
        if (images.find(name) == images.end()) order.push_back(name);
        images[name].add(luminanceOf(film));
        estimates[name].push_back(estimateError(film, PixelSet::All, setup.independent()).value_or(nothing));
    };
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        Progressive progressive(setup, setup.scene(seed));
        std::uint64_t there = 0;
        for (const std::uint64_t samples : kSamples) {
            progressive.render({there, samples});
            there = samples;
            look(fmt::format("{}", samples), progressive.film());
        }
        progressive.restart();
        progressive.render({0, 101});
        progressive.render({1000, 1233});
        look("101 + 233", progressive.film());
    }
    for (const std::string& name : order) {
        const Images& all = images[name];
        const double truth = all.relativeRmse();
        int known = 0, covered = 0, within = 0;
        double ratio = 0, squares = 0, dof = 0;
        for (std::size_t i = 0; i < estimates[name].size(); ++i) {
            const ErrorEstimate& e = estimates[name][i];
            dof += e.degrees_of_freedom / all.count();
            squares += e.relative_rmse * e.relative_rmse / all.count();
            if (!e.known()) continue;
            ++known;
            covered += e.relative_rmse_95.contains(truth);
            ratio += e.relative_rmse / truth;
            // Against the mean of the other seeds, whose own error is 1/(seeds - 1) of this one's square.
            std::vector<double> others = all.sum();
            for (std::size_t k = 0; k < others.size(); ++k)
                others[k] = (others[k] - all.all()[i][k]) / (all.count() - 1);
            within += relativeDistance(all.all()[i], others) / std::sqrt(1 + 1 / (all.count() - 1)) <=
                      e.half_width_95;
        }
        std::string rows;
        for (const ErrorEstimate& e : estimates[name])
            rows += fmt::format("{}[{:.6g}, {:.5g}, {:.4g}, {:.6g}]", rows.empty() ? "" : ", ",
                                e.relative_rmse / truth, e.degrees_of_freedom,
                                e.relative_rmse_95.lower / truth, e.relative_rmse_95.upper / truth);
        fmt::print("{{\"rows\": [{}], ", rows);
        fmt::print(
            "\"samples\": \"{}\", \"seeds\": {}, \"true\": {}, \"true_error\": {}, \"known\": {}, "
            "\"covered\": {}, \"within_half_width\": {}, \"ratio\": {}, "
            "\"ratio_of_all\": {}, \"degrees_of_freedom\": {}}}\n",
            name, seeds, truth, all.relativeError(), known, covered, within, known > 0 ? ratio / known : 0,
            std::sqrt(squares) / truth, dof);
        std::fflush(stdout);
    }
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

void stop(const Setup& setup, std::uint64_t seeds, double target, std::uint64_t most) {
    std::vector<double> truth;
    Setup independent = setup;
    independent.sampler = "independent";
    for (int i = 0; i < kReferenceRenders; ++i) {
        Progressive reference(independent,
                              independent.scene(kReferenceSeed + static_cast<std::uint64_t>(i)));
        reference.render({0, 16 * most / kReferenceRenders});
        const std::vector<double> y = luminanceOf(reference.film());
        truth.resize(y.size());
        for (std::size_t k = 0; k < y.size(); ++k) truth[k] += y[k] / kReferenceRenders;
    }
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        Progressive progressive(setup, setup.scene(seed));
        std::uint64_t there = 0;
        bool reached = false;
        Film film = progressive.film();
        while (!reached && there < most) {
            const std::uint64_t next = nextTargetCheck(there, film.counts.size());
            progressive.render({there, next});
            there = next;
            film = progressive.film();
            reached = reachesTarget(film, target, setup.independent());
        }
        fmt::print("{{\"seed\": {}, \"samples\": {}, \"reached\": {}, \"actual\": {}}}\n", seed, there,
                   reached, relativeDistance(luminanceOf(film), truth));
        std::fflush(stdout);
    }
}

}  // namespace

int main(int argc, char** argv) {
    const std::string mode = argc > 1 ? argv[1] : "";
    const bool is_stop = mode == "stop";
    if (argc != (is_stop ? 9 : 7) || (mode != "stated" && mode != "price" && !is_stop)) {
        std::fprintf(stderr,
                     "error_calibration stated|price BACKEND SCENE SIDE SAMPLER SEEDS\nerror_calibration "
                     "stop BACKEND SCENE SIDE SAMPLER SEEDS TARGET MOST\n");
        return 2;
    }
    const Listener listener(standardErrorSink(), LogLevel::Error);
    const ListenerScope scope(listener);
    try {
        Integrator integrator(loadBackend(argv[2]), {});
        const Setup setup{&integrator, argv[3], argv[5], std::stoi(argv[4])};
        const std::uint64_t seeds = std::stoull(argv[6]);
        if (mode == "stated") stated(setup, seeds);
        else if (mode == "price") price(setup, seeds);
        else stop(setup, seeds, std::stod(argv[7]), std::stoull(argv[8]));
        return 0;
    } catch (const Error& error) {
        std::fprintf(stderr, "error_calibration: %s\n", error.what());
        return error.exitCode();
    }
}
