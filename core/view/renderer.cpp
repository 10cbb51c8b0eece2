#include "view/renderer.h"

#include "base/error.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/stage.h"
#include "base/stopwatch.h"
#include "compile/change_view.h"
#include "render/brightest_path.h"
#include "view/silence.h"

#include <algorithm>
#include <new>
#include <utility>

namespace crt {
namespace {

/// Camera and film of the scene that is wished for, in pixels `divisor` times as large: what changeView()
/// takes.
Scene viewOf(const RenderWishes& wanted, unsigned divisor) {
    const Scene& scene = *wanted.scene;
    Scene view;
    view.camera = withPose(scene.camera, wanted.pose);
    const auto part = [d = static_cast<int>(divisor)](int pixels) { return (pixels + d - 1) / d; };
    view.film.width = part(scene.film.width);
    view.film.height = part(scene.film.height);
    if (const auto& [x0, y0, x1, y1] = scene.film.crop; x1 > x0) {
        const int left = x0 / static_cast<int>(divisor), top = y0 / static_cast<int>(divisor);
        view.film.crop = {left, top, std::max(left + 1, part(x1)), std::max(top + 1, part(y1))};
    }
    return view;
}

}  // namespace

bool RenderWishes::sameDevice(const RenderWishes& other) const {
    return backend == other.backend && integrator.device == other.integrator.device;
}

bool RenderWishes::samePicture(const RenderWishes& other) const {
    return sameDevice(other) && scene == other.scene && aovs == other.aovs && pose == other.pose;
}

Renderer::Renderer(RenderWishes wishes, Board& board, std::function<void(Snapshot)> hand_on)
    : board_(board),
      hand_on_(std::move(hand_on)),
      wishes_(std::move(wishes)),
      thread_([this, threads = wishes_.integrator.threads, listener = currentListener()] {
          const ListenerScope scope(listener);
          runWithThreads(threads, [this] { run(); });
      }) {}

Renderer::~Renderer() { stop(); }

void Renderer::wish(const std::function<void(RenderWishes&)>& change) {
    {
        const std::lock_guard lock(mutex_);
        change(wishes_);
        ++revision_;
    }
    changed_.notify_all();
}

void Renderer::stop() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    changed_.notify_all();
}

bool Renderer::hasWork() const {
    if (!wishes_.scene || failed_ == revision_.load()) return false;
    if (!applied_ || !applied_->samePicture(wishes_)) return true;
    return !wishes_.paused && (divisor_ > 1 || samples_ < wishes_.samplesWanted());
}

bool Renderer::waitForWork(RenderWishes& wanted) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return stopping_ || hasWork(); });
    wanted = wishes_;
    taken_ = revision_;
    return !stopping_;
}

void Renderer::run() {
    RenderWishes wanted;
    while (waitForWork(wanted)) {
        try {
            work(wanted);
        } catch (const Cancelled&) {
            applied_.reset();  // The film on the devices holds a part of a chunk.
        } catch (const std::bad_alloc&) {
            recover("out of memory on the host: a smaller film needs less (--set film.resolution)");
        } catch (const std::exception& error) {
            recover(error.what());
        }
    }
}

/// Whatever went wrong, the next wish begins anew.
void Renderer::recover(const std::string& what) {
    failed_ = taken_;
    applied_.reset();
    devices_.reset();
    compiled_.reset();
    session_.reset();
    films_.clear();
    logMessage(LogLevel::Error, what);
    board_.update([&](Status& status) {
        status.render_error = what;
        status.stage.clear();
    });
}

/// One step of the way: a small picture, a larger one, more samples of the whole.
void Renderer::work(const RenderWishes& wanted) {
    if (!session_ || (applied_ && !applied_->sameDevice(wanted))) openBackend(wanted);
    if (!compiled_ || compiled_of_ != wanted.scene || compiled_aovs_ != wanted.aovs)
        compile(wanted, *wanted.scene);
    if (!applied_ || !applied_->samePicture(wanted)) {
        seeScene(wanted);
        setView(wanted, pace_.firstDivisor(std::uint64_t{seen_->width} * seen_->height));
        return renderChunk(wanted, 1);
    }
    const std::uint64_t pixels = std::uint64_t{seen_->width} * seen_->height;
    if (divisor_ > 1) {
        setView(wanted, pace_.nextDivisor(pixels, divisor_));
        return renderChunk(wanted, 1);
    }
    const std::uint64_t count = pace_.samplesOfChunk(pixels, !board_.isWatched());
    renderChunk(wanted, std::min(count, wanted.samplesWanted() - samples_));
}

void Renderer::openBackend(const RenderWishes& wanted) {
    applied_.reset();
    devices_.reset();
    compiled_.reset();
    session_.reset();  // Two of them need not have room at once.
    pace_.forget();
    const Stage stage("opening the backend");
    session_ = std::make_unique<Session>(wanted.backend, wanted.integrator);
    session_->openDevice();
}

void Renderer::compile(const RenderWishes& wanted, const Scene& scene) {
    applied_.reset();
    devices_.reset();
    compiled_.reset();
    compiled_ = session_->compile(scene, wanted.aovs);
    compiled_of_ = wanted.scene;
    compiled_aovs_ = wanted.aovs;
    names_ = std::make_shared<const PrimitiveNames>(*compiled_, scene);
    paths_ = {scene.sampler.type != SamplerType::Sobol, brightestPathOf(*compiled_)};
    devices_.emplace(session_->group(), *compiled_);
}

/// A run begins: with the camera that is wished for.
void Renderer::seeScene(const RenderWishes& wanted) {
    ++runs_;
    shown_ = false;
    seconds_ = 0;
    SeenScene seen{.read = wanted.scene,
                   .pose = wanted.pose,
                   .camera = withPose(wanted.scene->camera, wanted.pose),
                   .names = names_,
                   .width = static_cast<std::uint32_t>(wanted.scene->film.width),
                   .height = static_cast<std::uint32_t>(wanted.scene->film.height),
                   .paths = paths_};
    if (const auto& [x0, y0, x1, y1] = wanted.scene->film.crop; x1 > x0) {
        seen.width = static_cast<std::uint32_t>(x1 - x0);
        seen.height = static_cast<std::uint32_t>(y1 - y0);
    }
    seen_ = std::make_shared<const SeenScene>(std::move(seen));
}

void Renderer::setView(const RenderWishes& wanted, unsigned divisor) {
    applied_.reset();
    const Scene view = viewOf(wanted, divisor);
    const CompileOptions options = compileOptionsFor(session_->backend());
    const auto change = [&] {
        // The scene's own camera was warned of already.
        const Silence silence;
        return changeView(*compiled_, view, options);
    };
    if (!change()) {
        Scene moved = *wanted.scene;
        moved.camera = view.camera;
        compile(wanted, moved);
        if (!change()) throw Error(ErrorKind::Internal, "a compiled scene does not take its own view");
    }
    devices_->setScene();
    divisor_ = divisor;
    samples_ = 0;
    applied_ = wanted;
}

/// A hand that goes on moving shall see what it does: the first picture of a run is always finished.
void Renderer::cancelWhereStale(const RenderWishes& wanted) {
    if (stopping_) throw Cancelled{};
    if (!shown_ || revision_ == taken_) return;
    const std::lock_guard lock(mutex_);
    if (!wanted.samePicture(wishes_)) throw Cancelled{};
}

void Renderer::renderChunk(const RenderWishes& wanted, std::uint64_t count) {
    const Stopwatch rendering;
    devices_->render({.first_sample = samples_, .sample_count = count},
                     [&](double) { cancelWhereStale(wanted); });
    if (devices_->inBands())
        throw Error(ErrorKind::Device,
                    "the film has no room on the device as a whole, and a view of parts would be no view: "
                    "'crt render' renders it in bands, and --set film.resolution makes it smaller");
    const double seconds = rendering.seconds();
    samples_ += count;
    seconds_ += seconds;
    pace_.rendered(std::uint64_t{compiled_->header().width} * compiled_->header().height, count, seconds);
    const Stopwatch handing;
    handOn(wanted);
    if (divisor_ == 1) pace_.handedOn(handing.seconds());
}

std::shared_ptr<Film> Renderer::spareFilm(const FilmShape& shape) {
    constexpr std::size_t kMostFilms = 4;  // Written, waiting, developed, sent.
    std::erase_if(films_, [&](const auto& film) { return !(film->shape() == shape); });
    for (const std::shared_ptr<Film>& film : films_)
        if (film.use_count() == 1) return film;
    auto film = std::make_shared<Film>(shape);
    if (films_.size() < kMostFilms) films_.push_back(film);
    return film;
}

void Renderer::handOn(const RenderWishes& wanted) {
    const std::shared_ptr<Film> film = spareFilm(filmShapeOf(*compiled_));
    film->samples = SampleRanges();
    devices_->readFilm(*film);
    const bool complete = divisor_ == 1 && samples_ >= wanted.samplesWanted();
    const std::string device = shown_ ? std::string() : arrayText(session_->report().device);
    board_.update([&](Status& status) {
        status.render_error.clear();
        status.stage.clear();
        status.width = seen_->width;
        status.height = seen_->height;
        status.samples = divisor_ == 1 ? samples_ : 0;
        status.samples_wanted = wanted.samplesWanted();
        status.seconds = seconds_;
        status.paths_per_second = pace_.pathsPerSecond();
        status.backend = session_->backend().name;
        if (!device.empty()) status.device = device;
    });
    shown_ = true;
    hand_on_({.seen = seen_,
              .film = film,
              .divisor = divisor_,
              .run = runs_,
              .complete = complete,
              .seconds = seconds_});
}

}  // namespace crt
