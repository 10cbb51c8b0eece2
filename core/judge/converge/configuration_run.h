/// One configuration at work: a scene variant on a backend, rendered progressively with one seed after
/// another.
#pragma once

#include "base/stopwatch.h"
#include "judge/converge/measurement.h"
#include "judge/converge/reference.h"
#include "judge/converge/replicate_file.h"
#include "render/session.h"
#include "scene/scene.h"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace crt::converge {

class ConfigurationRun {
public:
    using LoadScene = std::function<Scene()>;

    /// Loads the scene and the backend. Throws crt::Error when it cannot run.
    ConfigurationRun(Key key, LoadScene load, const Reference* reference, const IntegratorOptions& options);

    /// Compiles the scene and renders one sample that does not count: all that is needed before the first
    /// replicate, and timed as its start.
    void prepare();
    /// Starts from the beginning, and times that: start-up is noisy like rendering, and a time that includes
    /// both needs separate starts for several replicates. Nothing where a start waits for its replicate
    /// already.
    void restart();
    /// Times of the last start.
    double startSeconds() const { return start_seconds_; }

    /// Renders seed number `replicate` to N = 1, 2, 4 … and gives each look to `found`, until
    /// `most_samples`, or (on the first replicate) until the next doubling would take the replicate beyond
    /// `seconds`. Returns false when `stop` said so.
    bool replicate(std::uint32_t replicate, std::uint64_t most_samples, double seconds,
                   const std::function<void(const Row&)>& found, const std::function<bool()>& stop);

    const Key& key() const { return configuration_.key; }
    Configuration& configuration() { return configuration_; }
    std::uint64_t samplesReached() const { return samples_reached_; }
    const Scene& scene() const { return scene_; }
    const Reference* reference() const { return reference_; }
    /// The replicate that was rendered last, for a file; and one from a file, in its place. Requires
    /// prepare().
    StoredReplicate stored(std::uint32_t replicate) const;
    void restore(std::uint32_t replicate, const StoredReplicate& stored);
    std::size_t pixels() const { return std::size_t{configuration_.width} * configuration_.height; }
    double secondsOfLastReplicate() const { return seconds_of_last_; }
    /// All looks so far, by samples and replicate.
    std::map<std::uint64_t, std::map<std::uint32_t, LookPlane>>& looks() { return looks_; }
    /// Pictures of the last replicate at `map_samples` samples per pixel, one of its looks, and tests of all
    /// against the reference's eighths. Pictures of fewer samples than it reached are rendered again; where
    /// that fails, crt::Error is thrown and the tests are there.
    void finish(std::uint64_t map_samples);

private:
    /// Loads the scene, the backend and opens the device.
    void open();
    void describe(const CompiledScene& compiled);
    /// Renders the first sample; an empty film again.
    void warmUp(const CompiledScene& compiled);
    Row look(const Film& film, std::uint32_t replicate, bool last);
    /// The image of a film and its own standard error, for maps.
    void keepPicture(const Film& film, const Image& image, double mean_luminance);
    void renderPicture(std::uint32_t replicate, std::uint64_t samples);
    void fillMaps(std::uint64_t samples);

    Configuration configuration_;
    LoadScene load_;
    IntegratorOptions options_;
    Scene scene_;
    PathFacts paths_;
    std::uint64_t seed_ = 0;
    const Reference* reference_;
    std::unique_ptr<Session> session_;
    double start_seconds_ = 0;
    bool start_waits_ = false;  ///< For the replicate whose own it is.
    double seconds_of_last_ = 0;
    std::uint64_t samples_reached_ = 0;
    std::map<std::uint64_t, std::map<std::uint32_t, LookPlane>> looks_;
    stats::Replicates tests_;   ///< Colours at the most samples, one image a replicate.
    Image last_image_;
    Plane last_error_;          ///< The image's own standard error, relative to its mean.
};

/// The most samples that all runs of a scene reached: maps of the same samples can be compared.
std::uint64_t commonSamples(const std::vector<std::unique_ptr<ConfigurationRun>>& runs,
                            const std::string& scene);

/// Writes the error that follows from a comparison of replicates: (R − 1)/R · mean (I_r − mean of the
/// others)², into the rows.
void fillBetweenReplicates(std::vector<Row>& rows, const Key& key,
                           const std::map<std::uint64_t, std::map<std::uint32_t, LookPlane>>& looks);

}  // namespace crt::converge
