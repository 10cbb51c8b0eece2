/// Tables on disk, in the folder of base/cache_folder.h: the next run that needs one reads it. They depend
/// on a few numbers, of a material for example, and on nothing else of the scene, and take up to a second.
#pragma once

#include "base/file_cache.h"

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// The inputs of a table, and the memory of its values.
struct WantedTable {
    std::vector<double> inputs;
    std::span<std::byte> values;
};

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

    /// Reads the tables of a kind that are there, has the others made, and stores those. `make` gets their
    /// numbers in `wanted`, and fills their values in; it is not called where all are there.
    void loadOrMake(std::string_view kind, const std::vector<WantedTable>& wanted,
                    const std::function<void(const std::vector<std::size_t>& missing)>& make);

    /// The file of a table; empty where the store holds nothing.
    std::string path(std::string_view kind, const std::vector<double>& inputs) const;

private:
    FileCache::Key keyOf(std::string_view kind, const std::vector<double>& inputs) const;

    const std::string build_;
    const FileCache files_;
    bool has_stored_ = false;
};

}  // namespace crt
