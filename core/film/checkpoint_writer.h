/// Checkpoints while a render goes on: the film is copied, and another thread packs and writes the copy.
#pragma once

#include "base/error.h"
#include "film/checkpoint.h"
#include "film/film.h"

#include <functional>
#include <future>
#include <optional>
#include <string>

namespace crt {

/// Writes a film again and again; one copy at a time. [one thread]
class CheckpointWriter {
public:
    using Write = std::function<void(const Film&, const FilmIdentity&)>;

    explicit CheckpointWriter(const std::string& path);
    /// `write` is called on another thread, and throws crt::Error(Output) when it cannot.
    explicit CheckpointWriter(Write write) : write_(std::move(write)) {}
    /// Waits for the copy that is being written.
    ~CheckpointWriter() { finish(); }
    CheckpointWriter(const CheckpointWriter&) = delete;
    CheckpointWriter& operator=(const CheckpointWriter&) = delete;

    /// True if the last copy is written, so that save() need not wait for it.
    bool idle() const;
    /// Takes a copy of the film and writes it on another thread. If there is no memory for the copy or no
    /// thread, writes the film before it returns. Warns if the previous copy could not be written; rendering
    /// continues.
    void save(const Film& film, FilmIdentity identity);
    /// Waits for the copy that is being written, and warns when that fails. To be called before anything
    /// else writes the same file: otherwise the older film could end up in it.
    void finish();

private:
    Write write_;
    std::optional<Film> copy_;  ///< Of the last save(); kept, since another of its size is needed soon.
    std::future<std::optional<Error>> writing_;
};

}  // namespace crt
