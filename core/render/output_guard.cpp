#include "render/output_guard.h"

#include "base/error.h"
#include "film/checkpoint.h"

#include <fmt/format.h>

#include <filesystem>
#include <limits>
#include <sys/stat.h>
#include <system_error>

namespace crt {
namespace fs = std::filesystem;
namespace {

/// The same for all names of one file: by device and number of the file that is there, or by the name that
/// it will have.
std::string identityOf(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) == 0) return fmt::format("{}:{}", status.st_dev, status.st_ino);
    std::error_code unknown;
    const fs::path absolute = fs::absolute(path, unknown);
    const fs::path canonical = fs::weakly_canonical(absolute, unknown);
    return (unknown ? absolute.lexically_normal() : canonical).string();
}

constexpr std::uint64_t kNoFilm =
    std::numeric_limits<std::uint64_t>::max();  // Larger than any, so that it is never replaced.

}  // namespace

void refuseOverInputs(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs,
                      const std::vector<std::string>& films) {
    std::map<std::string, std::string> read, written;  // By identity, the name.
    for (const std::string& input : inputs) read.emplace(identityOf(input), input);
    const auto check = [&](const std::string& output) {
        const std::string identity = identityOf(output);
        if (const auto input = read.find(identity); input != read.end())
            throw Error(
                ErrorKind::Usage,
                output == input->second
                    ? fmt::format("the output '{}' would replace a file that is read", output)
                    : fmt::format("the output '{}' would replace '{}', which is read: they are one file",
                                  output, input->second),
                {output});
        if (const auto other = written.find(identity); other != written.end())
            throw Error(ErrorKind::Usage,
                        output == other->second
                            ? fmt::format("two outputs have the same name '{}'", output)
                            : fmt::format("the outputs '{}' and '{}' are one file", other->second, output));
        return identity;
    };
    for (const std::string& output : outputs) written.emplace(check(output), output);
    for (const std::string& film : films) check(film);
}

void FilmGuard::look(const std::string& path, bool wanted, bool replace) {
    if (const auto known = places_.find(path); known != places_.end()) {
        known->second.wanted = known->second.wanted || wanted;
        return;
    }
    std::error_code unreadable;
    Place place;
    place.wanted = wanted;
    if (!replace && fs::exists(path, unreadable)) {
        try {
            place.samples = readCheckpoint(path).first.samples.count();
        } catch (const Error& error) {
            if (wanted)
                throw Error(ErrorKind::Usage,
                            fmt::format("a film would replace '{}', which is none: {}; choose another name, "
                                        "or add --overwrite",
                                        path, error.what()),
                            {path});
            place.samples = kNoFilm;
        }
    }
    places_[path] = place;
}

void FilmGuard::requireRoom(std::uint64_t samples) const {
    for (const auto& [path, place] : places_)
        if (place.wanted && place.samples > samples)
            throw Error(ErrorKind::Usage,
                        fmt::format("'{}' holds {} samples per pixel and would be replaced by {}: add "
                                    "--resume to go on from it, or --overwrite "
                                    "to lose it, or choose another name",
                                    path, place.samples, samples),
                        {path});
}

std::string FilmGuard::placeFor(const std::string& path, std::uint64_t samples) {
    const auto found = places_.find(path);
    if (found == places_.end() || samples >= found->second.samples) return path;
    std::string& beside = found->second.beside;
    std::error_code unreadable;
    const std::string stem = fs::path(path).replace_extension().string();
    for (int number = 1; beside.empty(); ++number) {
        const std::string name = fmt::format("{}.partial{}{}", stem,
                                             number > 1 ? std::to_string(number) : "", kCheckpointExtension);
        if (!fs::exists(fs::symlink_status(name, unreadable))) beside = name;
    }
    return beside;
}

void FilmGuard::written(const std::string& path) {
    const auto found = places_.find(path);
    if (found == places_.end()) return;
    found->second.samples = 0;  // What lies there now is of this run.
    if (found->second.beside.empty()) return;
    std::error_code gone;
    fs::remove(found->second.beside, gone);
    found->second.beside.clear();
}

}  // namespace crt
