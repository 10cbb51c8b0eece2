#include "binding.h"

#include <string>
#include <utility>

namespace nb = nanobind;

namespace crt_python {
namespace {

constexpr double kSecondsBetweenProgress = 0.05;

}  // namespace

Listener::Listener(nb::object progress, nb::object stage, nb::object message)
    : progress_(std::move(progress)), stage_(std::move(stage)), message_(std::move(message)) {}

Listener::~Listener() = default;

template <class... Arguments>
void Listener::call(const nb::object& function, Arguments&&... arguments) {
    if (thrown_) return;
    try {
        function(std::forward<Arguments>(arguments)...);
    } catch (nb::python_error& error) {
        // Ctrl-C may come while a function of Python runs.
        if (error.matches(PyExc_KeyboardInterrupt))
            interrupted_ = true;
        else
            thrown_ = std::current_exception();
    } catch (...) {
        thrown_ = std::current_exception();
    }
}

void Listener::progress(const crt::Progress& now) {
    if (!progress_.is_valid() || progress_.is_none()) return;
    if (now.seconds < next_progress_seconds_ && now.fraction < 1) return;
    next_progress_seconds_ = now.seconds + kSecondsBetweenProgress;
    const nb::gil_scoped_acquire lock;
    nb::dict values;
    values["samples"] = now.samples;
    values["samples_wanted"] = now.samples_wanted;
    values["seconds"] = now.seconds;
    values["fraction"] = now.fraction;
    values["seconds_left"] = now.seconds_left < 0 ? nb::none() : nb::cast(now.seconds_left);
    values["paths_per_second"] = now.paths_per_second;
    values["relative_error"] = now.relative_error ? nb::cast(*now.relative_error) : nb::none();
    call(progress_, values);
}

bool Listener::stop() {
    const nb::gil_scoped_acquire lock;
    if (!interrupted_ && PyErr_CheckSignals() != 0) {
        // Ctrl-C keeps the film; what another handler of signals throws is the caller's.
        if (PyErr_ExceptionMatches(PyExc_KeyboardInterrupt)) {
            PyErr_Clear();
            interrupted_ = true;
        } else {
            thrown_ = std::make_exception_ptr(nb::python_error());
        }
    }
    return interrupted_ || thrown_ != nullptr;
}

void Listener::stage(std::string_view what) {
    if (!stage_.is_valid() || stage_.is_none()) return;
    const nb::gil_scoped_acquire lock;
    call(stage_, std::string(what).c_str());
}

void Listener::message(crt::MessageLevel level, std::string_view text) {
    if (!message_.is_valid() || message_.is_none()) return crt::Watch::message(level, text);
    const nb::gil_scoped_acquire lock;
    call(message_, static_cast<int>(level), std::string(text).c_str());
}

void Listener::raise() const {
    if (thrown_) std::rethrow_exception(thrown_);
}

}  // namespace crt_python
