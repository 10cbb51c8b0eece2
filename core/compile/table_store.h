/// Tables of materials on disk, in the folder of base/cache_folder.h: the next run that needs one reads it.
/// They depend on a few numbers of a material and on nothing else of the scene, and take up to a second.
#pragma once

#include "base/file_cache.h"

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// Looks the folder up once: for the tables of one scene. Where there is no folder, or this build cannot be
/// told from others, it holds nothing.
class TableStore {
public:
    TableStore();
    /// Makes room for what was stored.
    ~TableStore();
    TableStore(const TableStore&) = delete;
    TableStore& operator=(const TableStore&) = delete;

    /// Reads the values of a table of a kind ("loss") that this build made of these inputs. False, and
    /// `values` stays as it is, unless there is a table of exactly `bytes` bytes.
    bool load(std::string_view kind, const std::vector<double>& inputs, void* values,
              std::size_t bytes) const;
    void store(std::string_view kind, const std::vector<double>& inputs, const void* values,
               std::size_t bytes);

    /// The file of a table; empty where the store holds nothing.
    std::string path(std::string_view kind, const std::vector<double>& inputs) const;

private:
    FileCache::Key keyOf(std::string_view kind, const std::vector<double>& inputs) const;

    const std::string build_;
    const FileCache files_;
    bool has_stored_ = false;
};

}  // namespace crt
