#include "base/table_store.h"

#include "base/cache_folder.h"
#include "base/program_identity.h"

#include <cstdint>
#include <cstring>

namespace crt {
namespace {

/// More than a thousand tables: the largest have 3 MB, most have less than 50 kB.
constexpr std::uint64_t kMaxBytes = std::uint64_t{64} << 20;

}  // namespace

TableStore::TableStore()
    : build_(buildId()), files_(build_.empty() ? std::string() : cacheFolder(), ".crttable", kMaxBytes) {}

TableStore::~TableStore() {
    if (has_stored_) files_.makeRoom();
}

FileCache::Key TableStore::keyOf(std::string_view kind, const std::vector<double>& inputs) const {
    const std::string_view numbers(reinterpret_cast<const char*>(inputs.data()),
                                   inputs.size() * sizeof(double));
    return FileCache::makeKey({"table", build_, kind, numbers});
}

std::string TableStore::path(std::string_view kind, const std::vector<double>& inputs) const {
    return files_.path(keyOf(kind, inputs));
}

bool TableStore::load(std::string_view kind, const std::vector<double>& inputs, void* values,
                      std::size_t bytes) const {
    const auto found = files_.load(keyOf(kind, inputs));
    if (!found || found->size() != bytes) return false;
    std::memcpy(values, found->data(), bytes);
    return true;
}

void TableStore::store(std::string_view kind, const std::vector<double>& inputs, const void* values,
                       std::size_t bytes) {
    has_stored_ = files_.store(keyOf(kind, inputs), values, bytes) || has_stored_;
}

void TableStore::loadOrMake(std::string_view kind, const std::vector<WantedTable>& wanted,
                            const std::function<void(const std::vector<std::size_t>& missing)>& make) {
    std::vector<std::size_t> missing;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        const auto& [inputs, values] = wanted[i];
        if (!load(kind, inputs, values.data(), values.size())) missing.push_back(i);
    }
    if (missing.empty()) return;
    make(missing);
    for (const std::size_t i : missing)
        store(kind, wanted[i].inputs, wanted[i].values.data(), wanted[i].values.size());
}

}  // namespace crt
