#include "backend/device_group.h"

#include "base/listener.h"
#include "base/log.h"
#include "base/stopwatch.h"
#include "base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

namespace crt {
namespace {

/// Of what a backend counts from zero on with every scene.
void addCounts(const CrtBackendReport& from, CrtBackendReport& to) {
    to.paths += from.paths;
    to.closest_rays += from.closest_rays;
    to.shadow_rays += from.shadow_rays;
    to.render_seconds += from.render_seconds;
}

void clearCounts(CrtBackendReport& report) {
    report.paths = report.closest_rays = report.shadow_rays = 0;
    report.render_seconds = 0;
}

bool isListOfIndices(const std::string& text) {
    return text.find(',') != std::string::npos &&
           text.find_first_not_of("0123456789,") == std::string::npos;
}

std::string listOf(const std::vector<CrtDevice>& devices) {
    std::string text;
    for (const CrtDevice& device : devices)
        text += fmt::format("{}{} '{}'", text.empty() ? "" : ", ", device.index, arrayText(device.name));
    return text;
}

std::uint64_t pixelsOf(const CompiledScene& scene) {
    return std::uint64_t{scene.header().width} * scene.header().height;
}

std::uint64_t samplesOf(const std::vector<RenderRange>& ranges) {
    std::uint64_t samples = 0;
    for (const RenderRange& range : ranges) samples += range.sample_count;
    return samples;
}

/// `count` in whole parts, as `weights` are to one another. What rounding leaves goes to the largest
/// remainders, of equal ones to the first.
std::vector<std::uint64_t> shareOut(std::uint64_t count, const std::vector<double>& weights) {
    double all = 0;
    for (const double weight : weights) all += weight;
    std::vector<std::uint64_t> parts(weights.size());
    std::vector<std::pair<double, std::size_t>> remainders;
    std::uint64_t left = count;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        const double exact = static_cast<double>(count) * (weights[i] / all);
        parts[i] = std::min(static_cast<std::uint64_t>(exact), left);
        left -= parts[i];
        remainders.emplace_back(exact - static_cast<double>(parts[i]), i);
    }
    std::stable_sort(remainders.begin(), remainders.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    for (std::size_t i = 0; left > 0; i = (i + 1) % remainders.size(), --left)
        ++parts[remainders[i].second];
    return parts;
}

/// Puts what several devices say of their parts together.
class SharedProgress {
public:
    SharedProgress(std::size_t parts, const std::function<void(double)>& progress)
        : done_(parts, 0.0), progress_(progress) {}
    void part(std::size_t index, double done) {
        const std::lock_guard lock(mutex_);
        all_ += done - done_[index];
        done_[index] = done;
        if (progress_) progress_(std::clamp(all_, 0.0, 1.0));
    }

private:
    std::mutex mutex_;
    std::vector<double> done_;
    double all_ = 0;
    const std::function<void(double)>& progress_;
};

}  // namespace

struct DeviceGroup::Member {
    std::size_t index = 0;  ///< In members_.
    std::unique_ptr<Integrator> integrator;
    DeviceShare share;
    double score = 1;               ///< CrtDevice::score: what is known of its speed before it is measured.
    double samples_per_second = 0;  ///< Of the last range; 0: not measured.
    /// Its film as it was read last, with several devices only: what is in there outlives the device.
    std::optional<Film> read;
    std::vector<RenderRange> unread;  ///< What its own film has besides.
    bool lacks_room = false;  ///< Dropped for want of memory, and nothing else.
    std::uint64_t pixel_samples = 0;  ///< What share.samples stands for: a window may be a part of the film.
    bool has_scene = false;           ///< And what it counts belongs to it.
    CrtBackendReport earlier{};  ///< Of other windows of this scene: what backends count from zero on again.

    bool works() const { return share.failure.empty(); }
    /// Keeps what it counted of its scene, before it gets another.
    void keepCounts() {
        if (!std::exchange(has_scene, false)) return;
        try {
            addCounts(integrator->report(), earlier);
        } catch (const Error&) {
            // A device that is lost says so when it gets its scene.
        }
    }
    /// `count` modulo 2^64, so that it may be taken back.
    void countSamples(std::uint64_t count, std::uint64_t window_pixels, std::uint64_t film_pixels) {
        pixel_samples += count * window_pixels;
        share.samples = pixel_samples / film_pixels;
    }
};

/// What one device is to render.
struct DeviceGroup::Assignment {
    Member* member;
    std::vector<RenderRange> ranges;
};

std::vector<std::string> devicesNamed(const std::string& text, const std::vector<CrtDevice>& devices) {
    std::vector<std::string> names;
    if (text == "all") {
        for (const CrtDevice& device : devices) names.push_back(std::to_string(device.index));
        return names;
    }
    if (!isListOfIndices(text)) return {text};
    for (const std::string& index : splitAt(text, ',')) {
        const auto is_it = [&](const CrtDevice& device) { return std::to_string(device.index) == index; };
        if (std::none_of(devices.begin(), devices.end(), is_it))
            throw Error(ErrorKind::Usage, fmt::format("--device {}: there is no device '{}'; there is {}",
                                                      text, index, listOf(devices)));
        if (std::find(names.begin(), names.end(), index) != names.end())
            throw Error(ErrorKind::Usage,
                        fmt::format("--device {}: device {} is named twice", text, index));
        names.push_back(index);
    }
    return names;
}

DeviceGroup::DeviceGroup(const LoadedBackend& backend, const IntegratorOptions& options,
                         const std::vector<CrtDevice>& devices) {
    const std::vector<std::string> names = devicesNamed(options.device, devices);
    std::vector<Member*> opened;
    for (const std::string& name : names) {
        members_.push_back(std::make_unique<Member>());
        Member& member = *members_.back();
        member.index = members_.size() - 1;
        member.share.selector = name;
        for (const CrtDevice& device : devices)
            if (std::to_string(device.index) == name) {
                member.share.name = arrayText(device.name);
                member.score = std::max(device.score, 1e-3);
            }
        opened.push_back(&member);
    }
    const auto open = [&](Member& member) {
        IntegratorOptions own = options;
        own.device = names[member.index];
        member.integrator = std::make_unique<Integrator>(backend, own);
    };
    inParallel(opened, open, options.device == "all");
}

DeviceGroup::~DeviceGroup() = default;

std::vector<DeviceGroup::Member*> DeviceGroup::working() {
    std::vector<Member*> there;
    for (const auto& member : members_)
        if (member->works()) there.push_back(member.get());
    return there;
}

/// Does `work` for each, at the same time. Those whose device fails are dropped, unless none is left or none
/// may fail.
void DeviceGroup::inParallel(const std::vector<Member*>& members,
                             const std::function<void(Member&)>& work, bool may_fail) {
    // One device needs neither threads nor the rest: its errors are the group's.
    if (members_.size() == 1) return work(*members_.front());

    std::vector<std::exception_ptr> thrown(members.size());
    {
        std::vector<std::jthread> threads;
        for (std::size_t i = 0; i < members.size(); ++i)
            threads.emplace_back([&, i, listener = currentListener()] {
                const ListenerScope scope(listener);
                try {
                    work(*members[i]);
                } catch (...) {
                    thrown[i] = std::current_exception();
                }
            });
    }
    last_failure_.reset();
    for (std::size_t i = 0; i < members.size(); ++i) {
        if (!thrown[i]) continue;
        try {
            std::rethrow_exception(thrown[i]);
        } catch (const Error& error) {
            const bool of_device =
                error.kind() == ErrorKind::Device || error.kind() == ErrorKind::Backend;
            if (!may_fail || !of_device) throw;
            // Want of memory before all others: there something can be done.
            if (!last_failure_ || !last_failure_->lacksMemory()) last_failure_ = error;
            members[i]->share.failure = error.what();
            members[i]->lacks_room = error.lacksMemory();
        }
    }
    if (working().empty()) throw Error(*last_failure_);
    for (std::size_t i = 0; i < members.size(); ++i)
        if (thrown[i])
            logWarning("device {} '{}' is dropped, the others go on: {}", members[i]->share.selector,
                       members[i]->share.name, members[i]->share.failure);
}

void DeviceGroup::loadScene(const CompiledScene& scene, const std::function<void(double)>& progress) {
    const std::vector<Member*> there = working();
    for (const auto& member : members_) {
        member->read.reset();
        member->unread.clear();
    }
    SharedProgress shown(members_.size(), progress);
    const double part = 1.0 / static_cast<double>(std::max<std::size_t>(there.size(), 1));
    inParallel(there, [&](Member& member) {
        member.has_scene = false;
        member.integrator->setScene(scene, [&](double done) { shown.part(member.index, done * part); });
        member.has_scene = true;
    });
    window_pixels_ = pixelsOf(scene);
}

void DeviceGroup::readmitThoseWithoutRoom() {
    for (const auto& member : members_)
        if (std::exchange(member->lacks_room, false)) member->share.failure.clear();
}

void DeviceGroup::setScene(const CompiledScene& scene, const std::function<void(double)>& progress) {
    readmitThoseWithoutRoom();
    film_pixels_ = pixelsOf(scene);
    for (const auto& member : members_) {
        member->share.samples = 0;
        member->share.seconds = 0;
        member->pixel_samples = 0;
        member->earlier = {};
    }
    loadScene(scene, progress);
}

void DeviceGroup::setWindow(const CompiledScene& scene) {
    // Others are left out for good, or every window would try, and warn of, them again.
    if (working().empty()) readmitThoseWithoutRoom();
    for (const auto& member : members_) {
        for (const RenderRange& range : member->unread)
            member->countSamples(-range.sample_count, window_pixels_, film_pixels_);
        if (member->works()) member->keepCounts();
    }
    loadScene(scene, {});
}

/// Gives each device a share of `ranges` in proportion to its speed.
std::vector<DeviceGroup::Assignment> DeviceGroup::divide(std::vector<RenderRange> ranges) {
    const std::vector<Member*> there = working();
    std::vector<Assignment> work;
    std::vector<double> weights;
    // Who was not measured yet is as much faster or slower than the others as the scores say.
    double measured = 0, measured_score = 0;
    for (const Member* member : there) {
        if (member->samples_per_second <= 0) continue;
        measured += member->samples_per_second;
        measured_score += member->score;
    }
    const double per_score = measured > 0 ? measured / measured_score : 1;
    for (Member* member : there) {
        work.push_back({member, {}});
        weights.push_back(member->samples_per_second > 0 ? member->samples_per_second
                                                         : member->score * per_score);
    }

    const std::vector<std::uint64_t> counts = shareOut(samplesOf(ranges), weights);
    std::size_t next = 0;
    for (std::size_t i = 0; i < work.size(); ++i)
        for (std::uint64_t left = counts[i]; left > 0;) {
            RenderRange& open = ranges[next];
            RenderRange taken = open;
            taken.sample_count = std::min(left, open.sample_count);
            work[i].ranges.push_back(taken);
            open.first_sample += taken.sample_count;
            open.sample_count -= taken.sample_count;
            left -= taken.sample_count;
            if (open.sample_count == 0) ++next;
        }
    return work;
}

/// What was only in the films of devices that have failed, to be rendered again.
std::vector<RenderRange> DeviceGroup::collectLost() {
    std::vector<RenderRange> lost;
    for (const auto& member : members_) {
        if (member->works()) continue;
        lost.insert(lost.end(), member->unread.begin(), member->unread.end());
        for (const RenderRange& range : std::exchange(member->unread, {}))
            member->countSamples(-range.sample_count, window_pixels_, film_pixels_);
    }
    return lost;
}

void DeviceGroup::renderAll(std::vector<RenderRange> ranges, const std::function<void(double)>& progress) {
    while (!ranges.empty()) {
        const std::vector<Assignment> work = divide(ranges);
        std::vector<Member*> busy;
        std::vector<const Assignment*> of(members_.size());
        for (const Assignment& assignment : work) {
            if (assignment.ranges.empty()) continue;
            busy.push_back(assignment.member);
            of[assignment.member->index] = &assignment;
        }
        SharedProgress shown(members_.size(), progress);
        const double all = static_cast<double>(std::max<std::uint64_t>(samplesOf(ranges), 1));
        inParallel(busy, [&](Member& member) {
            const Stopwatch rendering;
            const std::vector<RenderRange>& own = of[member.index]->ranges;
            double before = 0;
            for (const RenderRange& range : own) {
                const auto count = static_cast<double>(range.sample_count);
                // Noted first: what is lost when it fails is this range, too.
                member.unread.push_back(range);
                member.countSamples(range.sample_count, window_pixels_, film_pixels_);
                member.integrator->render(range, [&](double done) {
                    shown.part(member.index, (before + done * count) / all);
                    return false;  // A range is always finished.
                });
                before += count;
            }
            const double seconds = rendering.seconds();
            member.share.seconds += seconds;
            member.samples_per_second = before / std::max(seconds, 1e-9);
        });
        ranges = collectLost();
    }
}

void DeviceGroup::render(const RenderRange& range, const std::function<void(double)>& progress) {
    if (members_.size() > 1) return renderAll({range}, progress);
    Member& only = *members_.front();
    const Stopwatch rendering;
    only.integrator->render(range, [&](double done) {
        if (progress) progress(done);
        return false;
    });
    only.share.seconds += rendering.seconds();
    only.countSamples(range.sample_count, window_pixels_, film_pixels_);
}

void DeviceGroup::readFilm(Film& film) {
    if (members_.size() == 1) return members_.front()->integrator->readFilm(film);
    do {
        renderAll(collectLost(), {});
        std::vector<Member*> changed;
        for (Member* member : working())
            if (!member->unread.empty()) changed.push_back(member);
        inParallel(changed, [&](Member& member) {
            Film now(film.shape());
            member.integrator->readFilm(now);
            member.read = std::move(now);
            member.unread.clear();
        });
    } while (std::any_of(members_.begin(), members_.end(),
                         [](const auto& member) { return !member->unread.empty(); }));
    // Without samples a film may hold anything.
    if (film.samples.count() == 0) film = Film(film.shape());
    for (const auto& member : members_)
        if (member->read) film.add(*member->read);
}

CrtBackendReport DeviceGroup::report() {
    CrtBackendReport together{};
    std::vector<std::string> names;
    for (Member* member : working()) {
        CrtBackendReport own = member->integrator->report();
        if (!member->has_scene) clearCounts(own);
        addCounts(member->earlier, own);
        if (names.empty()) together = own;
        names.push_back(arrayText(own.device));
        member->share.name = names.back();
        if (names.size() == 1) continue;
        together.kernel_from_cache &= own.kernel_from_cache;
        for (double CrtBackendReport::*seconds :
             {&CrtBackendReport::compile_seconds, &CrtBackendReport::cache_seconds,
              &CrtBackendReport::build_seconds, &CrtBackendReport::upload_seconds,
              &CrtBackendReport::render_seconds})
            together.*seconds = std::max(together.*seconds, own.*seconds);
        together.paths += own.paths;
        together.closest_rays += own.closest_rays;
        together.shadow_rays += own.shadow_rays;
        together.peak_memory_bytes += own.peak_memory_bytes;
    }
    if (names.size() > 1) {
        const bool same = std::all_of(names.begin(), names.end(),
                                      [&](const std::string& name) { return name == names.front(); });
        const std::string text = same ? fmt::format("{} x {}", names.size(), names.front())
                                      : fmt::format("{}", fmt::join(names, " + "));
        std::snprintf(together.device, sizeof together.device, "%s", text.c_str());
    }
    return together;
}

std::vector<DeviceShare> DeviceGroup::shares() const {
    std::vector<DeviceShare> shares;
    for (const auto& member : members_) shares.push_back(member->share);
    return shares;
}

}  // namespace crt
