/// Sums of samples: what a render gives, and what images are made of.
#pragma once

#include <crt/export.h>
#include <crt/image.h>
#include <crt/watch.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

CRT_API_NAMESPACE_BEGIN

/// A film's estimate of its error, relative to the image's mean luminance (docs/error.md): two numbers, one
/// of all images that differ in their seeds alone, one of this image.
struct ErrorEstimate {
    /// The expected error: root mean square over the pixels and over seeds, and its 95 % interval.
    double relative_rmse = 0;
    double relative_rmse_lower = 0, relative_rmse_upper = 0;
    /// With probability 95 % the error that this image really has is at most this.
    double half_width_95 = 0;
    double mean_luminance = 0;
    /// Light that no sample finds and no error includes, in words (docs/error.md); empty: none is known.
    std::vector<std::string> missing_light;
};

struct DevelopOptions {
    /// True if the scene's exposure and white balance are applied, as for .png; otherwise values are
    /// radiance, as in .exr.
    bool for_display = false;
    std::optional<double> exposure_ev{};  ///< Stops, instead of the scene's. Implies for_display.
    std::vector<std::string> aovs{};      ///< More planes, named as in scenes; the film must hold them.
};

/// Copies are deep. Sums do not depend on how a render was split, so that merging films of different samples
/// gives the bits of one render of all.
class CRT_API Film {
public:
    /// A .crtfilm file. Throws crt::Error of kind Usage when it is damaged or none.
    static Film load(const std::string& path);
    /// Written under another name and renamed. Throws crt::Error of kind Output.
    void save(const std::string& path) const;
    /// Adds the samples of another film of the same scene. Throws crt::Error of kind Usage, and changes
    /// nothing, when scenes or shapes differ or both hold the same samples.
    void merge(const Film& other, Watch* watch = nullptr);

    Film(const Film&);
    Film(Film&&) noexcept;
    Film& operator=(const Film&);
    Film& operator=(Film&&) noexcept;
    ~Film();

    std::uint32_t width() const;
    std::uint32_t height() const;
    /// Asked of each pixel.
    std::uint64_t samples() const;
    /// Their indices, half-open ranges in order.
    std::vector<std::pair<std::uint64_t, std::uint64_t>> sampleRanges() const;
    /// AOVs that the scene's outputs ask for, all of which the film holds: "albedo", "normal", …
    std::vector<std::string> aovs() const;
    /// Valid samples of one pixel: those that were NaN or infinite are left out.
    std::uint64_t count(std::uint32_t x, std::uint32_t y) const;
    /// X, Y and Z of one pixel: the mean of its valid samples, radiance under the CIE 1931 observer.
    std::array<double, 3> mean(std::uint32_t x, std::uint32_t y) const;
    /// Nothing where it is not known: too few samples, or one Sobol sequence.
    std::optional<ErrorEstimate> error() const;
    /// True if crt render --target-error would stop: the error is known and half_width_95 at most `target`
    /// of all pixels, and of the even and of the odd ones of a checkerboard.
    bool errorWithin(double target) const;

    /// Film → image in the scene's colour space.
    Image develop(const DevelopOptions& options = {}) const;
    /// Develops for the format, which the extension says, and writes with all metadata, as crt render does.
    void saveImage(const std::string& path, Watch* watch = nullptr) const;

    struct Impl;
    /// For libcrt itself.
    explicit Film(std::unique_ptr<Impl> impl);
    const Impl& impl() const { return *impl_; }
    Impl& impl() { return *impl_; }

private:
    std::unique_ptr<Impl> impl_;
};

CRT_API_NAMESPACE_END
