/// Results of a pure function, kept by their inputs for as long as the process runs.
#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

namespace crt {

/// Holds at most `most` results, and drops all of them when more would come. [any thread]
template <class Key, class Value>
class Memo {
public:
    explicit Memo(std::size_t most) : most_(most) {}

    /// The results for `keys`, in order. Calls make(keys) once, with the keys that have no result yet; it
    /// returns one result for each. Threads that miss the same key at the same time each make its result.
    template <class Make>
    std::vector<Value> of(const std::vector<Key>& keys, const Make& make) {
        std::vector<Value> values(keys.size());
        std::vector<Key> missing;
        std::vector<std::size_t> places;
        {
            const std::lock_guard lock(mutex_);
            for (std::size_t i = 0; i < keys.size(); ++i) {
                if (const auto found = kept_.find(keys[i]); found != kept_.end()) {
                    values[i] = found->second;
                } else {
                    missing.push_back(keys[i]);
                    places.push_back(i);
                }
            }
        }
        if (missing.empty()) return values;
        std::vector<Value> made = make(std::as_const(missing));
        const std::lock_guard lock(mutex_);
        for (std::size_t i = 0; i < missing.size(); ++i) {
            if (kept_.size() >= most_) kept_.clear();
            kept_.insert_or_assign(std::move(missing[i]), made[i]);
            values[places[i]] = std::move(made[i]);
        }
        return values;
    }

    void forget() {
        const std::lock_guard lock(mutex_);
        kept_.clear();
    }

private:
    const std::size_t most_;
    std::mutex mutex_;
    std::map<Key, Value> kept_;
};

}  // namespace crt
