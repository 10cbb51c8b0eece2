#include "api/border.h"
#include "base/words.h"
#include "film/error_estimate.h"
#include "image/image_io.h"
#include "render/outputs.h"
#include "render/sampling.h"
#include "scene/aov.h"

#include <fmt/format.h>

#include <utility>

namespace crt::v0 {
namespace {

std::uint32_t aovsNamed(const std::vector<std::string>& names) {
    std::uint32_t aovs = 0;
    for (const std::string& name : names) {
        const std::uint32_t bit = aovNamed(name);
        if (bit == 0)
            throw crt::Error(crt::ErrorKind::Usage, fmt::format("there is no AOV '{}'; there are {}", name,
                                                                fmt::join(aovNames(), ", ")));
        aovs |= bit;
    }
    return aovs;
}

void requirePixel(const crt::Film& film, std::uint32_t x, std::uint32_t y) {
    if (x >= film.shape().width || y >= film.shape().height)
        throw Error(ErrorKind::Internal, fmt::format("pixel {},{} lies outside the film of {} × {}", x, y,
                                                     film.shape().width, film.shape().height));
}

}  // namespace

Film Film::load(const std::string& path) {
    return api::acrossBorder(nullptr, [&] {
        auto film = std::make_unique<Impl>(Impl{readCheckpoint(path)});
        requireRecord(path, film->film.second);
        return Film(std::move(film));
    });
}

void Film::save(const std::string& path) const {
    api::acrossBorder(nullptr, [&] {
        checkWritable(path);
        writeCheckpoint(path, impl_->film.first, impl_->film.second);
    });
}

void Film::merge(const Film& other, Watch* watch) {
    api::acrossBorder(watch, [&] {
        mergeFilm(impl_->film, "the film", other.impl_->film.first, other.impl_->film.second,
                  "the other film");
    });
}

Film::Film(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Film::Film(const Film& other) : impl_(std::make_unique<Impl>(*other.impl_)) {}
Film::Film(Film&&) noexcept = default;
Film& Film::operator=(const Film& other) {
    impl_ = std::make_unique<Impl>(*other.impl_);
    return *this;
}
Film& Film::operator=(Film&&) noexcept = default;
Film::~Film() = default;

std::uint32_t Film::width() const { return impl_->film.first.shape().width; }
std::uint32_t Film::height() const { return impl_->film.first.shape().height; }
std::uint64_t Film::samples() const { return impl_->film.first.samples.count(); }
std::vector<std::pair<std::uint64_t, std::uint64_t>> Film::sampleRanges() const {
    return impl_->film.first.samples.ranges();
}

std::vector<std::string> Film::aovs() const {
    std::vector<std::string> names;
    for (const std::string& name : aovNames())
        if ((impl_->film.second.record->aovs & aovNamed(name)) != 0) names.push_back(name);
    return names;
}

std::uint64_t Film::count(std::uint32_t x, std::uint32_t y) const {
    const crt::Film& film = impl_->film.first;
    requirePixel(film, x, y);
    return film.counts[std::size_t{y} * film.shape().width + x];
}

std::array<double, 3> Film::mean(std::uint32_t x, std::uint32_t y) const {
    const crt::Film& film = impl_->film.first;
    requirePixel(film, x, y);
    return {film.mean(x, y, 0), film.mean(x, y, 1), film.mean(x, y, 2)};
}

std::optional<ErrorEstimate> Film::error() const {
    const auto& [film, identity] = impl_->film;
    const auto found = estimateError(film, PixelSet::All, identity.record->paths);
    if (!found || !found->known()) return std::nullopt;
    return ErrorEstimate{.relative_rmse = found->relative_rmse,
                         .relative_rmse_lower = found->relative_rmse_95.lower,
                         .relative_rmse_upper = found->relative_rmse_95.upper,
                         .half_width_95 = found->half_width_95,
                         .mean_luminance = found->mean_luminance,
                         .missing_light = identity.record->missing_light};
}

bool Film::errorWithin(double target) const {
    const auto& [film, identity] = impl_->film;
    return reachesTarget(film, target, identity.record->paths);
}

Image Film::develop(const DevelopOptions& options) const {
    return api::acrossBorder(nullptr, [&] {
        FilmIdentity identity = impl_->film.second;
        if (options.exposure_ev) identity.record->development.exposure_ev = *options.exposure_ev;
        const bool for_display = options.for_display || options.exposure_ev;
        const Output output{.file = {},
                            .format = for_display ? OutputFormat::Png : OutputFormat::Exr,
                            .aovs = aovsNamed(options.aovs),
                            .place = {}};
        return Image(
            std::make_unique<Image::Impl>(Image::Impl{developedImage(output, impl_->film.first, identity)}));
    });
}

void Film::saveImage(const std::string& path, Watch* watch) const {
    api::acrossBorder(watch, [&] {
        const auto& [film, identity] = impl_->film;
        const std::optional<OutputFormat> format = formatOfFile(path);
        if (!format)
            throw crt::Error(crt::ErrorKind::Usage,
                             fmt::format("the name of the image '{}' does not end in {}", path, kImageEnds));
        checkWritable(path);
        // An EXR holds the AOVs that the scene requests.
        const std::uint32_t aovs = *format == OutputFormat::Exr ? identity.record->aovs : 0;
        writeOutput({.file = path, .format = *format, .aovs = aovs, .place = {}}, film, identity);
    });
}

}  // namespace crt::v0
