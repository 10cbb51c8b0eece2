#include "cli/progress.h"
#include "film/error_text.h"

#include "base/log.h"
#include "base/unit_text.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

namespace crt {
namespace {

constexpr std::chrono::milliseconds kBarInterval{100};  // A person reads no faster, and a slow ssh keeps up.
constexpr std::chrono::seconds kLineInterval{10};

bool terminalCanDraw() {
    const char* term = std::getenv("TERM");
    return isatty(STDERR_FILENO) != 0 && term != nullptr && *term != '\0' &&
           std::string_view(term) != "dumb";
}

int terminalColumns() {
    winsize size{};
    // Some terminals (serial lines, emacs) answer zero columns; they get the width of a classical one.
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

void writeStderr(std::string_view text) {
    while (!text.empty()) {
        const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
        if (written <= 0) return;  // A bar that cannot be drawn is no reason to stop a render.
        text.remove_prefix(static_cast<std::size_t>(written));
    }
}

/// The samples and time that the target error, or 1 % without one, would still take. Power-of-two checks may
/// make it more.
std::string stillNeeded(const ProgressState& state) {
    const double target = state.target_error > 0 ? state.target_error : 0.01;
    // A bound forecasts nothing: the error lies below it by an unknown factor.
    if (!state.error->known() || state.error->half_width_95 <= target ||
        !(state.samples > state.start_samples))
        return {};
    const stats::Interval samples = state.error->samplesFor(target, state.samples);
    const double each = state.elapsed_seconds / (state.samples - state.start_samples);
    return fmt::format("  {:.3g} % at {} spp, in {}-{}", target * 100, sampleCountText(samples),
                       clockText((samples.lower - state.samples) * each),
                       clockText((samples.upper - state.samples) * each));
}

}  // namespace

std::string progressText(const ProgressState& state) {
    if (!state.label.empty() && state.target == 0)
        return fmt::format("{}  {}", state.label, clockText(state.elapsed_seconds));
    // The rest is indistinguishable from nothing.
    if (!state.label.empty() && state.secondsLeft() < 0)
        return fmt::format("{:3.0f} %  {}", std::floor(state.fraction() * 100), state.label);
    if (!state.label.empty())
        return fmt::format("{:3.0f} %  {}  {} left", std::floor(state.fraction() * 100), state.label,
                           clockText(state.secondsLeft()));
    std::string text =
        fmt::format("{:3.0f} %  {:.0f}", std::floor(state.fraction() * 100), std::floor(state.samples));
    text += state.target > 0 ? fmt::format("/{} spp", state.target) : std::string(" spp");
    if (state.pathsPerSecond() > 0) text += "  " + rateText(state.pathsPerSecond(), "paths/s");
    if (state.secondsLeft() >= 0) text += "  " + clockText(state.secondsLeft()) + " left";
    // Last, because a narrow terminal cuts here.
    if (state.error)
        text += "  " + expectedErrorText(*state.error, state.light_is_missing) + stillNeeded(state);
    return text;
}

std::string progressLine(const ProgressState& state) {
    std::string text = progressText(state);
    text.erase(0, text.find_first_not_of(' '));
    return text;
}

std::string progressBar(const ProgressState& state, int columns) {
    const std::string text = progressText(state);
    // One column stays free: a character in the last one makes some terminals wrap, and the line could not
    // be cleared.
    const int room = columns - 1 - static_cast<int>(text.size());
    if (room < 0) return text.substr(0, static_cast<std::size_t>(std::max(0, columns - 1)));
    const int cells = std::min(room - 3, 40);  // Two brackets and a space.
    const bool unknown = !state.label.empty() && state.target == 0;
    if (cells < 6 || unknown) return text;
    const auto full = static_cast<std::size_t>(std::floor(state.fraction() * cells));
    std::string bar(static_cast<std::size_t>(cells), ' ');
    std::fill_n(bar.begin(), full, '=');
    if (full < bar.size()) bar[full] = '>';
    return "[" + bar + "] " + text;
}

Progress::Progress(ProgressMode mode) : mode_(mode), listener_(currentListener()), shown_at_(Clock::now()) {
    if (mode_ == ProgressMode::Auto) mode_ = terminalCanDraw() ? ProgressMode::Bar : ProgressMode::Lines;
    if (mode_ == ProgressMode::Bar) setLogHook(listener_, aroundMessage, this);
}

Progress::~Progress() {
    if (mode_ != ProgressMode::Bar) return;
    setLogHook(listener_, nullptr, nullptr);
    clear();  // The summary that follows says more than the last state of the bar.
}

void Progress::update(const ProgressState& state) {
    if (mode_ == ProgressMode::None) return;
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;  // Another thread is showing something newer than the eye can tell from this.
    const Clock::time_point now = Clock::now();
    if (mode_ == ProgressMode::Lines) {
        if (now - shown_at_ < kLineInterval) return;
        shown_at_ = now;
        logInfo("{}", progressLine(state));
        return;
    }
    if (!text_.empty() && now - shown_at_ < kBarInterval) return;
    shown_at_ = now;
    text_ = progressBar(state, terminalColumns());
    draw();
}

void Progress::aroundMessage(bool before_message, void* user) {
    auto& self = *static_cast<Progress*>(user);
    const std::lock_guard lock(self.mutex_);
    if (before_message) {
        self.clear();
    } else {
        self.draw();
    }
}

void Progress::draw() {
    // One write, so that no other output can fall between clearing and drawing.
    if (!text_.empty()) writeStderr("\r\x1b[K" + text_);
}

void Progress::clear() {
    if (!text_.empty()) writeStderr("\r\x1b[K");
}

}  // namespace crt
