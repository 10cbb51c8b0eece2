#include "film/checkpoint.h"
#include "film/checkpoint_writer.h"

#include "base/log.h"

#include <chrono>
#include <exception>
#include <utility>

namespace crt {
namespace {

/// The error, if any.
std::optional<Error> tryTo(const CheckpointWriter::Write& write, const Film& film,
                           const FilmIdentity& identity) {
    try {
        write(film, identity);
        return std::nullopt;
    } catch (const Error& error) {
        return error;
    } catch (const std::exception& error) {  // Out of memory while packing.
        return Error(ErrorKind::Output, fmt::format("cannot write a checkpoint: {}", error.what()));
    }
}

}  // namespace

CheckpointWriter::CheckpointWriter(const std::string& path)
    : CheckpointWriter([path](const Film& film, const FilmIdentity& identity) {
          writeCheckpoint(path, film, identity);
      }) {}

bool CheckpointWriter::idle() const {
    return !writing_.valid() || writing_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

void CheckpointWriter::save(const Film& film, FilmIdentity identity) {
    finish();
    try {
        copy_ = film;
        writing_ = std::async(std::launch::async, [this, identity, listener = currentListener()] {
            const ListenerScope scope(listener);
            return tryTo(write_, *copy_, identity);
        });
    } catch (const std::exception&) {  // No memory for a copy, or no thread: write now.
        copy_.reset();
        std::promise<std::optional<Error>> written;
        written.set_value(tryTo(write_, film, identity));
        writing_ = written.get_future();
    }
}

void CheckpointWriter::finish() {
    if (!writing_.valid()) return;
    if (const std::optional<Error> failure = writing_.get())
        logWarning("{}; rendering continues, and crt tries again at the next checkpoint", failure->what());
}

}  // namespace crt
