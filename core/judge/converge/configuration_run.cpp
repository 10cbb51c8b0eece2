#include "judge/converge/configuration_run.h"
#include "film/resolve.h"

#include "backend/loader.h"
#include "base/stopwatch.h"
#include "compile/compile.h"
#include "film/error_estimate.h"
#include "film/luminance_error.h"
#include "film/pooled_variance.h"
#include "judge/converge/fits.h"
#include "judge/stats/color_difference.h"
#include "judge/stats/flip.h"
#include "judge/stats/metrics.h"
#include "judge/stats/squared_noise.h"
#include "render/brightest_path.h"
#include "render/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <numeric>

namespace crt::converge {
namespace {

/// The reference's luminances, one for each pixel.
std::vector<float> spread(const Reference& reference, std::size_t pixels) {
    if (reference.luminance.size() == pixels) return reference.luminance;
    return std::vector<float>(pixels, reference.luminance.front());
}

/// Variance of the reference's luminance, pixel by pixel; 0 where it is one number.
std::vector<double> referenceVariances(const Reference& reference, std::size_t pixels) {
    std::vector<double> variances(pixels, 0.0);
    if (reference.fold_luminance.empty()) return variances;
    std::vector<double> eighths(reference.fold_luminance.size());
    for (std::size_t p = 0; p < pixels; ++p) {
        for (std::size_t k = 0; k < eighths.size(); ++k) eighths[k] = reference.fold_luminance[k][p];
        variances[p] = stats::summarize(eighths).variance / static_cast<double>(eighths.size());
    }
    return variances;
}

double loadAverage() {
    double load = 0;
    return getloadavg(&load, 1) == 1 ? load : 0;
}

std::optional<double> clockMhz() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.rfind("cpu MHz", 0) == 0) return std::strtod(line.c_str() + line.find(':') + 1, nullptr);
    return std::nullopt;
}

}  // namespace

ConfigurationRun::ConfigurationRun(Key key, LoadScene load, const Reference* reference,
                                   const IntegratorOptions& options)
    : load_(std::move(load)), options_(options), reference_(reference), tests_(1, 1, 3) {
    configuration_.key = std::move(key);
    configuration_.threads = options.threads;
    open();
    seed_ = scene_.sampler.seed;
}

void ConfigurationRun::open() {
    session_.reset();
    scene_ = load_();
    const Stopwatch opening;
    session_ = std::make_unique<Session>(loadBackend(configuration_.key.backend), options_);
    session_->openDevice();
    start_seconds_ = scene_.parse_seconds + opening.seconds();
}

void ConfigurationRun::describe(const CompiledScene& compiled) {
    paths_ = {scene_.sampler.type != SamplerType::Sobol, brightestPathOf(compiled)};
    const CrtBackendReport report = session_->report();
    Configuration& c = configuration_;
    c.device = arrayText(report.device);
    c.kernel = arrayText(report.kernel);
    if (report.registers > 0) c.kernel += fmt::format(", {} registers", report.registers);
    if (report.kernel_from_cache != 0) c.kernel += ", from the cache";
    c.scene_file = scene_.file;
    c.scene_hash = compiled.hash;
    c.width = compiled.header().width;
    c.height = compiled.header().height;
    for (const std::string& feature : featureList(compiled.header().features))
        c.kept.push_back({feature, "the scene needs it"});
    for (const auto& [what, why] : compiled.left_out) c.left_out.push_back({what, why});
    c.stages.parse = scene_.parse_seconds;
    c.stages.build = compiled.compile_seconds + compiled.build_seconds + report.build_seconds;
    c.stages.compile = report.compile_seconds + report.cache_seconds;
    c.stages.upload = report.upload_seconds;
    tests_ = stats::Replicates(compiled.header().width, compiled.header().height, 3);
}

/// Measures a film after this number of samples.
Row ConfigurationRun::look(const Film& film, std::uint32_t replicate, bool last) {
    Row row;
    row.key = configuration_.key;
    row.seed = scene_.sampler.seed;
    row.replicate = replicate;
    row.samples = film.samples.count();
    row.invalid_samples = film.invalidSamples();
    row.load_average = loadAverage();
    row.cpu_clock_mhz = clockMhz();

    const Image image = resolveImage(film, developmentOf(scene_).forFloats(), 0);
    const std::size_t pixels = film.counts.size();
    LookPlane luminance = stats::luminances(image.pixels, stats::luminanceWeights(scene_.film.color_space));
    row.mean_luminance = stats::meanLuminance(luminance);
    if (paths_.brightest.rare)
        row.rare_luminance =
            paths_.brightest.luminance * std::exp2(developmentOf(scene_).forFloats().exposure_ev);
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t c = 0; c < 3; ++c)
            row.image_mean[c] += image.pixels[3 * p + c] / static_cast<double>(pixels);
    if (const std::optional<ErrorEstimate> own = estimateError(film, PixelSet::All, paths_);
        own && own->known())
        row.predicted_relative_rmse = {own->relative_rmse, own->relative_rmse_95.lower,
                                       own->relative_rmse_95.upper};

    if (reference_ != nullptr) {
        const stats::ErrorMetrics m = stats::errorMetrics(luminance, spread(*reference_, pixels));
        row.error =
            ErrorMetrics{m.mse, m.rmse, m.relative_rmse, m.relmse, m.smape, m.mae, m.max_absolute, {}, {}};
        for (const std::vector<float>& fold : reference_->fold_luminance)
            row.fold_mse.push_back(stats::meanSquaredDifference(luminance, fold));
        if (reference_->info.kind == ReferenceKind::Analytic) {
            row.image_mean.fill(row.mean_luminance);
        } else if (last && scene_.film.color_space == ColorSpace::LinearSrgb) {
            const stats::RgbView test{image.pixels, image.width, image.height},
                truth{reference_->rgb, image.width, image.height};
            row.error->flip_mean = stats::flipHdr(test, truth).mean;
            row.error->delta_e2000_mean = stats::deltaE2000(test, truth).mean;
        }
    }
    if (last) {
        std::vector<double> colors(image.pixels.begin(), image.pixels.end());
        tests_.add(colors);
        keepPicture(film, image, row.mean_luminance);
    }
    looks_[row.samples][replicate] = std::move(luminance);
    return row;
}

void ConfigurationRun::keepPicture(const Film& film, const Image& image, double mean_luminance) {
    last_image_ = image;
    last_error_ = {image.width, image.height, std::vector<float>(film.counts.size())};
    const LuminanceVariance variance(film);
    const double exposure = std::exp2(developmentOf(scene_).forFloats().exposure_ev);
    for (std::uint32_t y = 0; y < image.height; ++y)
        for (std::uint32_t x = 0; x < image.width; ++x)
            last_error_.values[std::size_t{y} * image.width + x] =
                static_cast<float>(std::sqrt(variance(x, y)) * exposure / mean_luminance);
}

/// The same seed and samples are the same bits as that replicate's look was.
void ConfigurationRun::renderPicture(std::uint32_t replicate, std::uint64_t samples) {
    scene_.sampler.seed = seed_ + 1 + replicate;
    const CompiledScene compiled = session_->compile(scene_);
    session_->group().setScene(compiled);
    session_->group().render({.first_sample = 0, .sample_count = samples});
    Film film(filmShapeOf(compiled));
    session_->group().readFilm(film);
    const Image image = resolveImage(film, developmentOf(scene_).forFloats(), 0);
    keepPicture(film, image, stats::meanLuminance(looks_.at(samples).at(replicate)));
}

/// Costs of the very first sample alone, such as an OpenCL driver that makes machine code late, belong to
/// the start and not to a replicate.
void ConfigurationRun::warmUp(const CompiledScene& compiled) {
    const Stopwatch start;
    session_->group().render({.first_sample = 0, .sample_count = 1});
    configuration_.stages.first_sample = start.seconds();
    start_seconds_ += configuration_.stages.first_sample;
    session_->group().setScene(compiled);
}

void ConfigurationRun::prepare() {
    const Stopwatch setup;
    const CompiledScene compiled = session_->compile(scene_);
    session_->group().setScene(compiled);
    start_seconds_ += setup.seconds();
    if (configuration_.width == 0) describe(compiled);
    warmUp(compiled);
    start_waits_ = true;
}

void ConfigurationRun::restart() {
    if (start_waits_) return;
    open();
    prepare();
}

StoredReplicate ConfigurationRun::stored(std::uint32_t replicate) const {
    StoredReplicate stored;
    for (const auto& [samples, planes] : looks_)
        if (const auto plane = planes.find(replicate); plane != planes.end())
            stored.looks.emplace_back(samples, plane->second);
    stored.rgb = last_image_.pixels;
    stored.standard_error = last_error_.values;
    return stored;
}

void ConfigurationRun::restore(std::uint32_t replicate, const StoredReplicate& stored) {
    for (const auto& [samples, plane] : stored.looks) looks_[samples][replicate] = plane;
    samples_reached_ = std::max(samples_reached_, stored.looks.back().first);
    tests_.add(std::vector<double>(stored.rgb.begin(), stored.rgb.end()));
    last_image_ = Image{};
    last_image_.width = configuration_.width;
    last_image_.height = configuration_.height;
    last_image_.channels = {"R", "G", "B"};
    last_image_.pixels = stored.rgb;
    last_image_.chromaticities = chromaticities(scene_.film.color_space);
    last_error_ = {configuration_.width, configuration_.height, stored.standard_error};
}

bool ConfigurationRun::replicate(std::uint32_t replicate, std::uint64_t most_samples, double seconds,
                           const std::function<void(const Row&)>& found, const std::function<bool()>& stop) {
    scene_.sampler.seed = seed_ + 1 + replicate;
    const CompiledScene compiled = session_->compile(scene_);
    session_->group().setScene(compiled);
    const Stopwatch start;

    const CrtBackendReport before = session_->report();
    const bool exploring = replicate == 0;
    double wall = 0;
    for (std::uint64_t done = 0, next = 1; done < most_samples; next *= 2) {
        if (stop()) return false;
        const Stopwatch step;
        session_->group().render({.first_sample = done, .sample_count = next - done});
        const double step_seconds = step.seconds();
        wall += step_seconds;
        done = next;
        if (exploring) samples_reached_ = done;

        Film film(filmShapeOf(compiled));
        session_->group().readFilm(film);
        // The next doubling takes as long as all before it, and its look some more.
        const bool last =
            done * 2 > most_samples || (exploring && start.seconds() + 2.2 * step_seconds > seconds);
        Row row = look(film, replicate, last);
        const CrtBackendReport now = session_->report();
        row.render_wall_seconds = wall;
        if (now.render_seconds > before.render_seconds)
            row.render_device_seconds = now.render_seconds - before.render_seconds;
        if (start_waits_) row.seconds_before_first_sample = start_seconds_;
        row.paths = now.paths - (before.paths <= now.paths ? before.paths : 0);
        row.closest_rays = now.closest_rays - std::min(before.closest_rays, now.closest_rays);
        row.shadow_rays = now.shadow_rays - std::min(before.shadow_rays, now.shadow_rays);
        if (last) row.stop_reason = "samples";
        found(row);
        if (last) break;
    }
    configuration_.stages.render_wall = wall;
    seconds_of_last_ = start.seconds() + (start_waits_ ? start_seconds_ : 0);
    start_waits_ = false;
    return true;
}

void ConfigurationRun::finish(std::uint64_t map_samples) {
    if (last_image_.pixels.empty()) return;
    if (reference_ != nullptr && !reference_->fold_rgb.empty() && tests_.count() >= 2) {
        stats::Replicates eighths(configuration_.width, configuration_.height, 3);
        for (const std::vector<double>& fold : reference_->fold_rgb) eighths.add(fold);
        configuration_.tests = imageTestsOf(stats::gate(tests_, eighths));
    }
    map_samples = std::min(map_samples, samples_reached_);
    if (map_samples < samples_reached_)
        renderPicture(looks_.at(samples_reached_).rbegin()->first, map_samples);
    fillMaps(map_samples);
}

void ConfigurationRun::fillMaps(std::uint64_t samples) {
    Configuration& c = configuration_;
    c.maps.samples = samples;
    c.maps.image = last_image_;
    c.maps.standard_error = last_error_;
    if (reference_ == nullptr) return;

    const std::size_t pixels = std::size_t{c.width} * c.height;
    const std::vector<float> truth = spread(*reference_, pixels);
    const std::uint32_t replicate = looks_.at(samples_reached_).rbegin()->first;
    const LookPlane& luminance = looks_.at(samples).at(replicate);
    const double mean = std::accumulate(truth.begin(), truth.end(), 0.0) / static_cast<double>(pixels);
    c.maps.error = {c.width, c.height, std::vector<float>(pixels)};
    c.maps.z = c.maps.error;
    std::vector<double> variances = referenceVariances(*reference_, pixels);
    for (std::size_t p = 0; p < pixels; ++p)
        variances[p] = variances[p] / (mean * mean) + std::pow(double{last_error_.values[p]}, 2);
    const double dof = std::max(1, replicatesOf(scene_) - 1);
    const std::vector<double> pooled = stats::variancesWithoutZeros(
        stats::pooledVariances(variances, c.width, c.height, dof).variances, c.width, c.height);
    for (std::size_t p = 0; p < pixels; ++p) {
        const double difference = (luminance[p] - truth[p]) / mean;
        c.maps.error.values[p] = static_cast<float>(std::abs(difference));
        c.maps.z.values[p] = pooled[p] > 0 ? static_cast<float>(difference / std::sqrt(pooled[p])) : 0.0f;
    }
    if (reference_->fold_rgb.empty()) return;
    if (scene_.film.color_space == ColorSpace::LinearSrgb)
        c.maps.flip = {
            c.width, c.height,
            stats::flipHdr({last_image_.pixels, c.width, c.height}, {reference_->rgb, c.width, c.height})
                .error};
}

std::uint64_t commonSamples(const std::vector<std::unique_ptr<ConfigurationRun>>& runs,
                            const std::string& scene) {
    std::uint64_t samples = std::numeric_limits<std::uint64_t>::max();
    for (const auto& run : runs)
        if (run->key().scene == scene && run->samplesReached() > 0)
            samples = std::min(samples, run->samplesReached());
    return samples;
}

void fillBetweenReplicates(std::vector<Row>& rows, const Key& key,
                           const std::map<std::uint64_t, std::map<std::uint32_t, LookPlane>>& looks) {
    for (const auto& [samples, replicates] : looks) {
        const auto count = static_cast<double>(replicates.size());
        if (count < 2) continue;
        std::vector<double> sum(replicates.begin()->second.size());
        for (const auto& [replicate, plane] : replicates)
            for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += plane[p];
        std::vector<double> variances, values;
        stats::SquaredNoise noise;
        for (std::size_t p = 0; p < sum.size(); ++p) {
            values.clear();
            for (const auto& [replicate, plane] : replicates) values.push_back(plane[p]);
            noise.add(values);
            variances.push_back(stats::summarize(values).variance);
        }
        const double effective = stats::effectivePixels(variances, count - 1);
        const std::optional<double> heavy_tail_values = noise.heavyTailValues();
        for (Row& row : rows) {
            if (!(row.key == key) || row.samples != samples) continue;
            const auto found = replicates.find(row.replicate);
            if (found == replicates.end()) continue;
            double squares = 0;
            for (std::size_t p = 0; p < sum.size(); ++p) {
                const double mine = found->second[p], others = (sum[p] - mine) / (count - 1);
                squares += (mine - others) * (mine - others);
            }
            row.between_replicates_mse = (count - 1) / count * squares / static_cast<double>(sum.size());
            row.effective_pixels = effective;
            row.heavy_tail_values = heavy_tail_values;
        }
    }
}

}  // namespace crt::converge
