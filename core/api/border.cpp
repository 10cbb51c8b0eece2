#include "api/border.h"

#include <cstdio>
#include <string>
#include <utility>

namespace crt {

static_assert(static_cast<int>(LogLevel::Debug) == static_cast<int>(v0::MessageLevel::Debug) &&
              static_cast<int>(LogLevel::Info) == static_cast<int>(v0::MessageLevel::Info) &&
              static_cast<int>(LogLevel::Warning) == static_cast<int>(v0::MessageLevel::Warning) &&
              static_cast<int>(LogLevel::Error) == static_cast<int>(v0::MessageLevel::Error));
static_assert(static_cast<int>(ErrorKind::Internal) == static_cast<int>(v0::ErrorKind::Internal) &&
              static_cast<int>(ErrorKind::Usage) == static_cast<int>(v0::ErrorKind::Usage) &&
              static_cast<int>(ErrorKind::Scene) == static_cast<int>(v0::ErrorKind::Scene) &&
              static_cast<int>(ErrorKind::Backend) == static_cast<int>(v0::ErrorKind::Backend) &&
              static_cast<int>(ErrorKind::Device) == static_cast<int>(v0::ErrorKind::Device) &&
              static_cast<int>(ErrorKind::Output) == static_cast<int>(v0::ErrorKind::Output));

namespace api {

Heard::Heard(v0::Watch* watch) {
    if (watch == nullptr) {
        scope_.emplace(ListenerRef());
        return;
    }
    listener_.emplace(
        [watch](LogLevel level, std::string_view text) {
            watch->message(static_cast<v0::MessageLevel>(level), text);
        },
        LogLevel::Debug, [watch](const std::string& what) { watch->stage(what); });
    scope_.emplace(*listener_);
}

}  // namespace api

namespace v0 {

Error::Error(ErrorKind kind, const std::string& sentence, SourcePlace place)
    : std::runtime_error(sentence), kind_(kind), place_(std::move(place)) {}
Error::~Error() = default;
Error::Error(const Error&) = default;
Error& Error::operator=(const Error&) = default;

Watch::Watch() = default;
Watch::~Watch() = default;
void Watch::progress(const Progress&) {}
bool Watch::stop() { return false; }
void Watch::stage(std::string_view) {}
void Watch::message(MessageLevel level, std::string_view text) {
    if (level != MessageLevel::Warning && level != MessageLevel::Error) return;
    const std::string line = std::string("crt: ") +
                             (level == MessageLevel::Error ? "error: " : "warning: ") + std::string(text) +
                             "\n";
    std::fwrite(line.data(), 1, line.size(), stderr);
}

}  // namespace v0
}  // namespace crt
