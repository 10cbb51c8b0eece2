#include "output_guard.h"

#include "checkpoint.h"
#include "error.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <sys/stat.h>
#include <system_error>
#include <utility>

namespace crt {
namespace fs = std::filesystem;
namespace {

using FileIdentity = std::pair<dev_t, ino_t>;

/// Of the file that a name leads to, through links; nothing while there is none.
std::optional<FileIdentity> identityOf(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) return std::nullopt;
    return FileIdentity{status.st_dev, status.st_ino};
}

/// The same for two names of a file that is still to be written.
std::string finalName(const std::string& path) {
    std::error_code unknown;
    const fs::path absolute = fs::absolute(path, unknown);
    const fs::path canonical = fs::weakly_canonical(absolute, unknown);
    return (unknown ? absolute.lexically_normal() : canonical).string();
}

bool sameFile(const std::string& a, const std::string& b) {
    const std::optional<FileIdentity> one = identityOf(a), other = identityOf(b);
    return one || other ? one == other : finalName(a) == finalName(b);
}

constexpr std::uint64_t kNoFilm = std::numeric_limits<std::uint64_t>::max();  // Larger than any, so that it is never replaced.

}  // namespace

void refuseOverInputs(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs, const std::vector<std::string>& films) {
    std::vector<std::string> all = outputs;
    all.insert(all.end(), films.begin(), films.end());
    for (const std::string& output : all)
        for (const std::string& input : inputs) {
            const std::optional<FileIdentity> there = identityOf(output);
            if (there && there == identityOf(input))
                throw Error(ErrorKind::Usage,
                            output == input ? fmt::format("the output '{}' would replace a file that is read", output)
                                            : fmt::format("the output '{}' would replace '{}', which is read: they are one file", output, input),
                            {output});
        }
    for (std::size_t i = 0; i < all.size(); ++i)
        for (std::size_t j = 0; j < i && j < outputs.size(); ++j)
            if (sameFile(all[i], all[j]))
                throw Error(ErrorKind::Usage, all[i] == all[j] ? fmt::format("two outputs have the same name '{}'", all[i])
                                                               : fmt::format("the outputs '{}' and '{}' are one file", all[j], all[i]));
}

void FilmGuard::look(const std::string& path, bool wanted, bool replace) {
    std::error_code unreadable;
    Place place;
    place.wanted = wanted;
    if (!replace && fs::exists(path, unreadable)) {
        try {
            place.samples = readCheckpoint(path).first.samples.count();
        } catch (const Error& error) {
            if (wanted)
                throw Error(ErrorKind::Usage, fmt::format("a film would replace '{}', which is none: {}; choose another name, or add --overwrite", path, error.what()), {path});
            place.samples = kNoFilm;
        }
    }
    places_[path] = place;
}

void FilmGuard::requireRoom(std::uint64_t samples) const {
    for (const auto& [path, place] : places_)
        if (place.wanted && place.samples > samples)
            throw Error(ErrorKind::Usage, fmt::format("'{}' holds {} samples per pixel and would be replaced by {}: add --resume to go on from it, or "
                                                      "--overwrite to lose it, or choose another name",
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
        const std::string name = fmt::format("{}.partial{}{}", stem, number > 1 ? std::to_string(number) : "", kCheckpointExtension);
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
