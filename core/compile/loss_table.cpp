#include "compile/loss_table.h"

#include "base/for_avx2.h"
#include "base/memo.h"
#include "base/parallel.h"
#include "base/table_store.h"
#include "compile/reflectance.h"
#include "compile/visible_normals.h"
#include "kernel/materials/bsdf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace crt {
namespace {

constexpr std::size_t kLossSteps = static_cast<std::size_t>(CRT_LOSS_STEPS), kStride = CRT_LOSS_STRIDE;
static_assert(kLossSteps + 2 == static_cast<std::size_t>(CRT_LOSS_MEAN) &&
              kLossSteps + 3 == static_cast<std::size_t>(CRT_LOSS_PASSED) &&
              kLossSteps + 4 < CRT_LOSS_SHARES && CRT_LOSS_SHARES + kLossSteps + 1 < kStride);

/// Along a textured roughness.
constexpr std::uint32_t kRoughnesses = 33;

/// Sets the mean of a row, 2 ∫ L c dc of what the kernel reads between its nodes: linear in t = √c,
/// where it is 4 ∫ L t³ dt. And the shares of the steps in it.
void integrate(float* row) {
    std::array<double, kLossSteps + 1> below{};
    for (std::size_t cell = 0; cell < kLossSteps; ++cell) {
        const double i = static_cast<double>(cell), first = row[cell], step = row[cell + 1] - first;
        below[cell + 1] = below[cell] + first * (((i + 1.5) * i + 1) * i + 0.25) +
                          step * (((i / 2 + 1) * i + 0.75) * i + 0.2);
    }
    constexpr double n = kLossSteps;
    row[kLossSteps + 2] = static_cast<float>(4 * below[kLossSteps] / (n * n * n * n));
    for (std::size_t i = 0; i <= kLossSteps; ++i)
        row[CRT_LOSS_SHARES + i] = static_cast<float>(below[i] / below[kLossSteps]);
}

/// Direction of the azimuth that crt_azimuth takes for `at`, at a cosine.
Vec3d atAzimuth(double at, double cosine, double narrowing) {
    const double x = 1 - at, y = at / std::sqrt(narrowing), size = std::sqrt(x * x + y * y);
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    return {sine * x / size, sine * y / size, cosine};
}

/// The share of all azimuths that each row stands for, of what is linear between them.
std::array<double, CRT_LOSS_AZIMUTHS> azimuthShares(double narrowing) {
    static const auto azimuths = halfCircle<4096>();
    std::array<double, CRT_LOSS_AZIMUTHS> shares{};
    for (const auto& [x, y] : azimuths) {
        const double across = std::sqrt(narrowing) * y, along = std::abs(x);
        const double at = across / (along + across) * (CRT_LOSS_AZIMUTHS - 1.0);
        const std::size_t i = std::min<std::size_t>(static_cast<std::size_t>(at), CRT_LOSS_AZIMUTHS - 2);
        const double f = at - static_cast<double>(i);
        shares[i] += (1 - f) / static_cast<double>(azimuths.size());
        shares[i + 1] += f / static_cast<double>(azimuths.size());
    }
    return shares;
}

/// Gives the rows of all azimuths, `step` apart, the mean and the shares of the whole.
void integrateAzimuths(float* rows, std::size_t step, double narrowing) {
    const auto azimuths = azimuthShares(narrowing);
    std::array<float, kStride> mean{};
    for (std::size_t i = 0; i <= kLossSteps + 1; ++i) {
        double sum = 0;
        for (std::size_t a = 0; a < azimuths.size(); ++a)
            sum += azimuths[a] * static_cast<double>(rows[a * step + i]);
        mean[i] = static_cast<float>(sum);
    }
    integrate(mean.data());
    for (std::size_t a = 0; a < azimuths.size(); ++a) {
        rows[a * step + kLossSteps + 2] = mean[kLossSteps + 2];
        std::copy(mean.begin() + CRT_LOSS_SHARES, mean.end(), rows + a * step + CRT_LOSS_SHARES);
    }
}

/// Reflectance of a film by the cosine, from one side: the kernel's, so that both are of one mind.
class FilmReflectance {
public:
    FilmReflectance(const Interface& film, bool inside) : values_(kCells + 2) {
        const double before = inside ? film.index : 1;
        for (std::size_t i = 0; i < values_.size(); ++i)
            values_[i] = static_cast<double>(kernel::crt_film_reflectance_lane(
                static_cast<float>(std::min(1.0, static_cast<double>(i) / kCells)),
                static_cast<float>(film.film_index / before), static_cast<float>(film.film_rounds * before),
                static_cast<float>(inside ? 1 / film.index : film.index), 0.0f));
    }
    double operator()(double cosine) const {
        const double x = std::min(cosine, 1.0) * kCells;
        const int i = static_cast<int>(x);  // Vectors convert int, and not size_t.
        return values_[i] + (x - i) * (values_[i + 1] - values_[i]);
    }

private:
    static constexpr std::size_t kCells = 2048;
    std::vector<double> values_;
};

/// As of compensation.h; `reflectance` is that of the interface, `open` the share of light towards a
/// direction, turned to this side of the surface, that nothing is in the way of. `kFineness`: of the rule.
template <std::size_t kFineness, class F, class G>
double microfacetLoss(const Vec3d& w, double eta, const Widths& alpha, const F& reflectance, const G& open) {
    const auto above = [&](double cos_m, const Vec3d& m) { return 1 - open(m * (2 * cos_m) - w); };
    if (eta == 0) return meanOverVisibleNormals<32, kFineness>(w, alpha, above);
    const auto both = [&](double cos_m, const Vec3d& m) {
        const double refraction = (eta - 1) * (eta + 1) + cos_m * cos_m;
        const double reflected = reflectance(cos_m), lost_above = above(cos_m, m);
        const Vec3d bent = w - m * (cos_m - std::sqrt(refraction));
        const double lost = reflected * lost_above +
                            (1 - reflected) * (1 - open({bent[0] / eta, bent[1] / eta, bent[2] / eta}));
        return refraction > 0 ? lost : lost_above;
    };
    return eta < 1 ? meanOverVisibleNormals<kFineness, kFineness>(w, alpha, both)
                   : meanOverVisibleNormals<32, kFineness>(w, alpha, both);
}

/// The function that computes one row.
struct Row {
    double index, alpha;
    std::shared_ptr<const FilmReflectance> film;  ///< Null: the interface has none.
    double narrowing = 0, azimuth = 0;            ///< As of crt_azimuth.

    /// work(reflectance by the cosine)
    template <class Work>
    double withReflectance(const Work& work) const {
        if (film) return work(*film);
        return work([eta = index](double c) { return dielectricReflectance(c, eta); });
    }

    CRT_FOR_AVX2_TOO double loss(double cosine) const {
        return withReflectance([&](const auto& reflectance) {
            if (narrowing == 0)
                return microfacetLoss<128>(atCosine(cosine), index, {alpha, alpha}, reflectance,
                                           [&](const Vec3d& w) { return unshadowed(cosine, w[2], alpha); });
            const Vec3d w_o = atAzimuth(azimuth, cosine, narrowing);
            const Widths widths{alpha, narrowing * alpha};
            return microfacetLoss<64>(w_o, index, widths, reflectance,
                                      [&](const Vec3d& w) { return unshadowed(w_o, w, widths); });
        });
    }
};

std::uint32_t roughnessesOf(const LossKey& key) {
    return key.narrowing > 0 ? CRT_LOSS_AZIMUTHS : key.textured ? kRoughnesses : 1;
}

}  // namespace

double stepsOf(const LossPlan& plan) {
    const auto& [key, across] = plan;
    // As microfacetLoss() has them, of both halves of the azimuths where those differ. The denser side of
    // glass is finer.
    const double above = key.narrowing > 0 ? 2 * 32 * 64 : 32 * 128;
    const double below = key.narrowing > 0 ? 2 * 64 * 64 : 128 * 128;
    return static_cast<double>(across.interfaces.size()) * roughnessesOf(key) * (kLossSteps + 1) *
           (key.refracts ? above + below : above);
}

namespace {

/// A table without its values, and the rows that they are made by.
struct Draft {
    explicit Draft(const LossPlan& plan);

    LossKey key;
    kernel::CrtLoss record{};
    std::vector<Row> rows;
};

Draft::Draft(const LossPlan& plan) : key(plan.key) {
    const Across& across = plan.across;
    record.sides = key.refracts ? 2 : 1;
    record.by_azimuth = key.narrowing > 0;
    record.roughnesses = roughnessesOf(key);
    record.indices = static_cast<std::uint32_t>(across.interfaces.size());
    record.first_index = static_cast<float>(across.first);
    record.index_scale = static_cast<float>(1 / across.step);

    for (const Interface& i : across.interfaces) {
        std::array<std::shared_ptr<const FilmReflectance>, 2> films;
        for (std::uint32_t side = 0; side < record.sides && i.film_rounds > 0; ++side)
            films[side] = std::make_shared<FilmReflectance>(i, side != 0);
        for (std::uint32_t r = 0; r < record.roughnesses; ++r)
            for (std::uint32_t side = 0; side < record.sides; ++side) {
                const double roughness =
                    key.textured ? static_cast<double>(r) / (record.roughnesses - 1) : key.roughness;
                // Narrower ones are smooth; between them and the first row the kernel needs one more.
                const double alpha = std::max<double>(roughness * roughness, CRT_ALPHA_MIN);
                rows.push_back({side == 0 ? i.index : 1 / i.index, alpha, films[side]});
                if (!record.by_azimuth) continue;
                rows.back().narrowing = key.narrowing;
                rows.back().azimuth = static_cast<double>(r) / (CRT_LOSS_AZIMUTHS - 1.0);
            }
    }
}

/// Gives the rows of a table, whose losses are there, their means and shares.
void finish(const Draft& plan, std::vector<float>& rows) {
    for (std::size_t i = 0; i < plan.rows.size(); ++i) {
        float* const values = rows.data() + i * kStride;
        values[kLossSteps + 1] = values[kLossSteps];
        integrate(values);
        if (plan.key.refracts)
            values[kLossSteps + 3] =
                static_cast<float>(1 - plan.rows[i].withReflectance([](const auto& reflectance) {
                    return cosineMean(1024, reflectance);
                }));
    }
    if (!plan.record.by_azimuth) return;
    const std::size_t step = plan.record.sides * kStride;
    for (std::size_t i = 0; i < plan.record.indices; ++i)
        for (std::size_t side = 0; side < plan.record.sides; ++side)
            integrateAzimuths(rows.data() + i * CRT_LOSS_AZIMUTHS * step + side * kStride, step,
                              plan.key.narrowing);
}

/// The inputs of a table as the store takes them.
std::vector<double> inputsOf(const LossPlan& plan) {
    const auto& [key, across] = plan;
    std::vector<double> inputs{key.refracts ? 1.0 : 0.0,
                               key.least,
                               key.most,
                               key.textured ? 1.0 : 0.0,
                               key.roughness,
                               key.narrowing,
                               across.first,
                               across.step};
    for (const Interface& i : across.interfaces)
        inputs.insert(inputs.end(), {i.index, i.film_index, i.film_rounds});
    return inputs;
}

/// Computes the rows of tables.
void fill(const std::vector<Draft>& plans, const std::vector<std::size_t>& missing,
          std::vector<LossTable>& tables) {
    struct Work {
        const Row* row;
        float* values;
    };
    std::vector<Work> work;
    for (const std::size_t t : missing)
        for (std::size_t i = 0; i < plans[t].rows.size(); ++i)
            work.push_back({&plans[t].rows[i], tables[t].rows.data() + i * kStride});
    parallelFor(work.size() * (kLossSteps + 1), 8, [&](std::size_t first, std::size_t end) {
        for (std::size_t n = first; n < end; ++n) {
            const auto& [row, values] = work[n / (kLossSteps + 1)];
            const std::size_t i = n % (kLossSteps + 1);
            const double t = static_cast<double>(i) / kLossSteps;
            values[i] = static_cast<float>(row->loss(std::max(t * t, 1e-6)));
        }
    });
    parallelFor(missing.size(), 1, [&](std::size_t first, std::size_t end) {
        for (std::size_t m = first; m < end; ++m) finish(plans[missing[m]], tables[missing[m]].rows);
    });
}

std::vector<LossTable> makeLossTables(const std::vector<LossPlan>& plans) {
    const std::vector<Draft> drafts(plans.begin(), plans.end());
    std::vector<LossTable> tables(plans.size());
    std::vector<WantedTable> wanted;
    for (std::size_t t = 0; t < plans.size(); ++t) {
        tables[t].record = drafts[t].record;
        tables[t].rows.resize(drafts[t].rows.size() * kStride);
        wanted.push_back({inputsOf(plans[t]), std::as_writable_bytes(std::span(tables[t].rows))});
    }
    TableStore().loadOrMake("losses of microfacets", wanted,
                            [&](const std::vector<std::size_t>& missing) { fill(drafts, missing, tables); });
    return tables;
}

/// Most tables have less than 50 kB; the largest, of textured dispersive glass, has 1 MB.
Memo<LossPlan, LossTable>& keptTables() {
    static Memo<LossPlan, LossTable> kept(128);
    return kept;
}

}  // namespace

std::vector<LossTable> lossTablesOf(const std::vector<LossPlan>& plans) {
    return keptTables().of(plans, makeLossTables);
}

void forgetLossTables() { keptTables().forget(); }

double microfacetLoss(double cosine, double eta, double alpha) {
    return Row{eta, alpha, nullptr}.loss(cosine);
}

}  // namespace crt
