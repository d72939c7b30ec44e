#include "tools/pyramid/spool_rows.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cassert>
#include <span>
#include <utility>
#include <vector>

#include "tools/stage_clock.h"

namespace scree {
namespace {

constexpr std::int64_t kBandRows = 16;

template <class T>
class Spooler {
public:
    Spooler(ImageSource& dem, const VoidRule& voids, SuspectValues& suspects, HeightSpool& spool)
        : dem_(dem), voids_(voids), suspects_(suspects), spool_(spool) {}

    Result<void> run(const std::function<bool(std::int64_t)>& on_rows) {
        if (auto ok = read(0, next_); !ok) return ok;
        for (std::int64_t j = 0; j < spool_.height(); j += kBandRows) {
            std::swap(current_, next_);
            Result<void> taken, read_ahead;
            tbb::parallel_invoke([&] { read_ahead = read(j + kBandRows, next_); }, [&] { taken = take(current_); });
            if (!taken) return taken;
            if (!read_ahead) return read_ahead;
            if (!on_rows(std::min(kBandRows, spool_.height() - j)))
                return Error{ErrorCode::interrupted, "stopped while heights were read"};
        }
        return {};
    }

private:
    Result<void> read(std::int64_t begin, std::vector<T>& band) {
        const std::int64_t end = std::min(begin + kBandRows, spool_.height());
        if (begin >= end) return {};
        const StageClock::Scope clock(Stage::decode);
        band.resize(static_cast<std::size_t>((end - begin) * spool_.width()));
        return dem_.read_channel(begin, end, std::span<T>(band));
    }

    Result<void> take(std::vector<T>& band) {
        {
            const StageClock::Scope clock(Stage::decode);
            suspects_.add(std::span<const T>(band));
            voids_.apply(std::span<T>(band));
        }
        const StageClock::Scope clock(Stage::store);
        return spool_.append(std::span<const T>(band));
    }

    ImageSource& dem_;
    const VoidRule& voids_;
    SuspectValues& suspects_;
    HeightSpool& spool_;
    std::vector<T> current_, next_;
};

}  // namespace

std::int64_t spool_rows_bytes(std::int64_t width) { return 2 * kBandRows * width * 8; }

Result<void> spool_rows(ImageSource& dem, const VoidRule& voids, SuspectValues& suspects, HeightSpool& spool,
                        const std::function<bool(std::int64_t rows)>& on_rows) {
    assert(dem.info().width == spool.width() && dem.info().height == spool.height());
    return spool.wide() ? Spooler<double>(dem, voids, suspects, spool).run(on_rows)
                        : Spooler<float>(dem, voids, suspects, spool).run(on_rows);
}

}  // namespace scree
