#include "render/device_film.h"

#include "base/log.h"
#include "base/parallel.h"
#include "base/stopwatch.h"
#include "kernel/dialect/layout.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace crt {
namespace {

constexpr std::size_t kRowsAtOnce = 16;

/// The scene with another window, until this goes.
class Windowed {
public:
    Windowed(CompiledScene& scene, std::uint32_t first_row, std::uint32_t rows)
        : header_(scene.header()), height_(header_.height), crop_y_(header_.crop_y) {
        set(crop_y_ + first_row, rows);
    }
    ~Windowed() { set(crop_y_, height_); }
    Windowed(const Windowed&) = delete;
    Windowed& operator=(const Windowed&) = delete;

private:
    void set(std::uint32_t crop_y, std::uint32_t height) {
        header_.crop_y = crop_y;
        header_.height = height;
    }

    kernel::CrtScene& header_;
    const std::uint32_t height_, crop_y_;
};

/// to[first_row, …) = part.
void putRows(const Film& part, std::uint32_t first_row, Film& to) {
    const auto copy = [&](const auto& from, auto& into, std::size_t values_a_pixel) {
        if (from.empty()) return;
        const std::size_t row = values_a_pixel * part.shape().width;
        parallelFor(part.shape().height, kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
            std::copy_n(&from[begin * row], (end - begin) * row, &into[(first_row + begin) * row]);
        });
    };
    copy(part.sums, to.sums, std::size_t{2} * part.shape().channels);
    copy(part.counts, to.counts, 1);
    copy(part.primitives, to.primitives, 1);
}

}  // namespace

DeviceFilm::DeviceFilm(DeviceGroup& devices, CompiledScene& scene) : devices_(devices), scene_(scene) {}

void DeviceFilm::setWindow(const Band& band) {
    const Windowed window(scene_, band.first, band.rows());
    devices_.setWindow(scene_);
}

void DeviceFilm::setScene(const std::function<void(double)>& progress) {
    bands_.clear();
    unread_.reset();
    rendered_ = false;
    try {
        devices_.setScene(scene_, progress);
    } catch (const Error& error) {
        if (!error.lacksMemory() || scene_.header().height == 1) throw;
        beginBands(error);
    }
}

/// Devices do not say how much of a film they could hold: other programs share their memory, and drivers
/// take some of it when they see fit. So it is tried.
void DeviceFilm::beginBands(const Error& why) {
    if (scene_.header().splat_scale != 0)
        throw Error(ErrorKind::Device,
                    fmt::format("{}; and a film whose samples add to other pixels than their own cannot be "
                                "rendered in bands: reduce it, or render parts of it with --crop",
                                why.what()));
    std::uint32_t rows = scene_.header().height;
    for (bool fits = false; !fits;) {
        rows = (rows + 1) / 2;
        try {
            setWindow({0, rows});
            fits = true;
        } catch (const Error& error) {
            if (!error.lacksMemory() || rows == 1) throw;  // Not the film is too large, but the scene.
        }
    }
    cut(0, rows);
    logInfo("{}; so it is rendered in {} bands of {} rows, with the same result", why.what(), bands_.size(),
            bands_.front().rows());
}

/// Into bands of about the same size, of at most `rows`, from `first` on.
void DeviceFilm::cut(std::uint32_t first, std::uint32_t rows) {
    const std::uint32_t all = scene_.header().height - first;
    const std::uint32_t count = (all + rows - 1) / rows;
    const std::uint32_t even = (all + count - 1) / count;
    std::erase_if(bands_, [first](const Band& band) { return band.first >= first; });
    for (; first < scene_.header().height; first += even)
        bands_.push_back({first, std::min(first + even, scene_.header().height)});
}

void DeviceFilm::render(const RenderRange& range, const std::function<void(double)>& progress) {
    if (!inBands()) {
        try {
            devices_.render(range, progress);
            rendered_ = true;
            return;
        } catch (const Error& error) {
            // A film may just have fitted, with too little left to work in. Later than the first time there
            // is something on the devices that would be lost.
            if (!error.lacksMemory() || rendered_ || scene_.header().height == 1) throw;
            beginBands(error);
        }
    }
    renderInBands(range, progress);
}

void DeviceFilm::renderInBands(const RenderRange& range, const std::function<void(double)>& progress) {
    const FilmShape shape = filmShapeOf(scene_);
    if (!pass_) pass_.emplace(shape);
    fixed_seconds_ = 0;
    for (std::size_t i = 0; i < bands_.size();) {
        const Band band = bands_[i];
        try {
            renderBand(band, range, [&](double done) {
                if (progress) progress((band.first + band.rows() * done) / shape.height);
            });
            ++i;
        } catch (const Error& error) {
            if (!error.lacksMemory() || band.rows() == 1) throw;
            // Another process has taken memory since the last time, or the rest was too little to work in.
            cut(band.first, (band.rows() + 1) / 2);
            logInfo("{}; so it is rendered in bands of {} rows from row {} on", error.what(),
                    bands_[i].rows(), band.first);
        }
    }
    pass_->samples = SampleRanges({{range.first_sample, range.first_sample + range.sample_count}});
    if (unread_) {
        const Stopwatch adding;
        unread_->add(*pass_);
        fixed_seconds_ += adding.seconds();
    } else {
        unread_ = std::exchange(pass_, std::nullopt);
    }
}

void DeviceFilm::renderBand(const Band& band, const RenderRange& range,
                            const std::function<void(double)>& progress) {
    const Stopwatch setting;
    setWindow(band);
    fixed_seconds_ += setting.seconds();
    devices_.render({.first_sample = range.first_sample, .sample_count = range.sample_count}, progress);
    const Stopwatch reading;
    FilmShape shape = filmShapeOf(scene_);
    shape.height = band.rows();
    if (!part_ || !(part_->shape() == shape)) {
        part_.reset();  // Two need not be there at once.
        part_.emplace(shape);
    }
    part_->samples = SampleRanges();
    devices_.readFilm(*part_);
    putRows(*part_, band.first, *pass_);
    fixed_seconds_ += reading.seconds();
}

void DeviceFilm::readFilm(Film& film) {
    if (!inBands()) return devices_.readFilm(film);
    if (!unread_) return;
    const Stopwatch adding;
    if (film.samples.count() > 0)
        film.add(*unread_);
    else
        std::swap(film, *unread_);
    pass_ = std::exchange(unread_, std::nullopt);
    fixed_seconds_ += adding.seconds();
}

}  // namespace crt
