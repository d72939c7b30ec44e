#include "runtime/window/ground_probe.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>

#include "common/query/ground.h"
#include "tests/runtime/lod/memory_store.h"

namespace scree {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

test::SyntheticTerrain hills(std::uint64_t seed) {
    test::TerrainShape shape;
    shape.cells_x = shape.cells_y = 256;
    return test::SyntheticTerrain(shape, test::rough_heights(seed, 800));
}

/// Counts answers; whoever waits for one is woken.
class Answers {
public:
    std::function<void()> note() {
        return [this] {
            const std::lock_guard lock(mutex_);
            ++count_;
            changed_.notify_all();
        };
    }
    std::int64_t count() const {
        const std::lock_guard lock(mutex_);
        return count_;
    }
    /// False after a minute: never, but where the probe is broken.
    template <class Condition>
    bool wait(const Condition& holds) const {
        const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
        for (;;) {
            const std::int64_t seen = count();
            if (holds()) return true;
            std::unique_lock lock(mutex_);
            if (!changed_.wait_until(lock, end, [&] { return count_ != seen; })) return false;
        }
    }

private:
    mutable std::mutex mutex_;
    mutable std::condition_variable changed_;
    std::int64_t count_ = 0;
};

class Probe : public testing::Test {
protected:
    explicit Probe(int max_latency_us = 0)
        : terrain_(hills(9)), store_(std::make_shared<test::MemoryStore>(terrain_, max_latency_us)) {}

    /// A place over sample (i, j), where the height is that sample's.
    glm::dvec2 place(std::int64_t i, std::int64_t j) const {
        return {terrain_.lattice().x_m(static_cast<double>(i)), terrain_.lattice().y_m(static_cast<double>(j))};
    }
    double height(std::int64_t i, std::int64_t j) const { return terrain_.height_m(i, j); }
    std::uint64_t cast_down(GroundProbe& probe, GroundProbe::Ray which, std::int64_t i, std::int64_t j) const {
        return probe.cast(which, {place(i, j), 1e4}, {0, 0, -1}, 0);
    }
    bool answered(const GroundProbe& probe, GroundProbe::Ray which, std::uint64_t question) const {
        return answers_.wait([&] { return probe.last_hit(which).question == question; });
    }

    test::SyntheticTerrain terrain_;
    std::shared_ptr<test::MemoryStore> store_;
    Answers answers_;
};

using Ray = GroundProbe::Ray;

TEST_F(Probe, AnswersAHeightByTheNextCallOrALaterOne) {
    GroundProbe probe(store_, answers_.note());
    const glm::dvec2 p = place(70, 90);
    EXPECT_FALSE(probe.height_m(p.x, p.y));
    ASSERT_TRUE(answers_.wait([&] { return probe.height_m(p.x, p.y).has_value(); }));
    EXPECT_NEAR(*probe.height_m(p.x, p.y), height(70, 90), 1e-9);
    EXPECT_EQ(answers_.count(), 1) << "the same place is not asked for twice";
    // Outside there is none, once that is known.
    ASSERT_TRUE(answers_.wait([&] { return !probe.height_m(p.x - 1e6, p.y); }));
    EXPECT_FALSE(probe.height_m(kNaN, 0));
}

TEST_F(Probe, AnswersARayWithItsNumber) {
    GroundProbe probe(store_, answers_.note());
    EXPECT_EQ(probe.last_hit(Ray::click).question, 0u);
    const auto first = cast_down(probe, Ray::click, 10, 20);
    EXPECT_EQ(first, 1u);
    ASSERT_TRUE(answered(probe, Ray::click, first));
    const auto hit = probe.last_hit(Ray::click);
    ASSERT_TRUE(hit.point);
    EXPECT_LT(glm::length(*hit.point - glm::dvec3(place(10, 20), height(10, 20))), 1e-6);
    const auto up = probe.cast(Ray::click, {place(10, 20), 1e4}, {0, 0, 1}, 0);
    ASSERT_TRUE(answered(probe, Ray::click, up));
    EXPECT_FALSE(probe.last_hit(Ray::click).point);
    EXPECT_EQ(probe.last_hit(Ray::cursor).question, 0u) << "each use has its own";
    const auto odd = probe.cast(Ray::middle, {kNaN, 0, 0}, {0, 0, 1}, 0);
    ASSERT_TRUE(answered(probe, Ray::middle, odd));
    EXPECT_FALSE(probe.last_hit(Ray::middle).point);
}

TEST_F(Probe, AsksTheSameRayOnceButEveryClick) {
    GroundProbe probe(store_, answers_.note());
    EXPECT_EQ(cast_down(probe, Ray::cursor, 1, 2), 1u);
    EXPECT_EQ(cast_down(probe, Ray::cursor, 1, 2), 1u);
    EXPECT_EQ(cast_down(probe, Ray::cursor, 1, 3), 2u);
    EXPECT_EQ(cast_down(probe, Ray::click, 1, 2), 1u);
    EXPECT_EQ(cast_down(probe, Ray::click, 1, 2), 2u);
    EXPECT_TRUE(answered(probe, Ray::cursor, 2) && answered(probe, Ray::click, 2));
}

TEST_F(Probe, ABentRayEndsWhereTheGroundIsLowered) {
    GroundProbe probe(store_, answers_.note());
    // An earth of 5 km: 2 km on, the ground is 400 m lower.
    const glm::dvec3 eye{place(20, 128), terrain_.dataset().max_height_m + 50}, ahead{1, 0, -0.15};
    const auto flat = probe.cast(Ray::cursor, eye, ahead, 0), bent = probe.cast(Ray::click, eye, ahead, 1e-4);
    ASSERT_TRUE(answered(probe, Ray::cursor, flat) && answered(probe, Ray::click, bent));
    const auto straight = probe.last_hit(Ray::cursor).point, curved = probe.last_hit(Ray::click).point;
    ASSERT_TRUE(straight);
    if (curved) {
        EXPECT_GT(curved->x, straight->x + 1) << "goes on over the horizon";
    }
}

TEST_F(Probe, GivesHeightsAlongALine) {
    GroundProbe probe(store_, answers_.note());
    EXPECT_EQ(probe.last_profile(), nullptr);
    // From outside, along a row of samples.
    const glm::dvec2 from = place(-10, 40), to = place(50, 40);
    probe.profile(from, to, 61);
    ASSERT_TRUE(answers_.wait([&] { return probe.last_profile() != nullptr; }));
    const auto profile = probe.last_profile();
    EXPECT_EQ(profile->from_m, from);
    EXPECT_EQ(profile->to_m, to);
    ASSERT_EQ(profile->points.size(), 61u);
    for (int k = 0; k < 61; ++k) {
        const Profile::Point& p = profile->points[static_cast<std::size_t>(k)];
        EXPECT_NEAR(p.along_m, 10 * k, 1e-6);
        ASSERT_EQ(p.height_m.has_value(), k >= 10) << k;
        // Rounding puts a place beside its sample: by 1e-9 m of a slope of a thousand at most.
        if (k >= 10) {
            EXPECT_NEAR(*p.height_m, height(k - 10, 40), 1e-5) << k;
        }
    }
}

TEST_F(Probe, BringsAProfilesCountToWhatIsAllowed) {
    GroundProbe probe(store_, answers_.note());
    for (const int count : {-5, 1, 1'000'000'000}) {
        const auto before = probe.last_profile();
        probe.profile(place(1, 1), place(60, 90), count);
        ASSERT_TRUE(answers_.wait([&] { return probe.last_profile() != before; }));
        EXPECT_EQ(probe.last_profile()->points.size(), count < 2 ? 2u : 4096u);
    }
    const auto before = probe.last_profile();
    probe.profile({kNaN, 0}, {1, 1}, 5);
    const auto next = cast_down(probe, Ray::click, 1, 1);
    ASSERT_TRUE(answered(probe, Ray::click, next));
    EXPECT_EQ(probe.last_profile(), before);
}

TEST_F(Probe, ANewerQuestionTakesThePlaceOfOneThatWaits) {
    store_->hold();
    GroundProbe probe(store_, answers_.note());
    cast_down(probe, Ray::click, 1, 1);
    store_->wait_for_reads(1);
    for (int k = 2; k < 50; ++k) cast_down(probe, Ray::click, k, 1);
    EXPECT_EQ(answers_.count(), 0);
    store_->release();
    ASSERT_TRUE(answered(probe, Ray::click, 49));
    EXPECT_NEAR(probe.last_hit(Ray::click).point->z, height(49, 1), 1e-6);
    EXPECT_EQ(answers_.count(), 2) << "the first and the last";
}

/// Asks for another height whenever an answer comes, as whoever moves does, until all else is answered; notes after
/// how many answers that was. On the probe's thread alone, but for what is atomic.
class Mover {
public:
    Mover(const test::MemoryStore& store, const std::function<void()>& note)
        : lattice_(store.dataset().lattice), note_(note) {}
    std::function<void()> on_answer() {
        return [this] {
            if (GroundProbe* const probe = probe_) look(*probe);
        };
    }
    void begin(GroundProbe& probe) { probe_ = &probe; }
    int click_after() const { return click_after_; }
    int profile_after() const { return profile_after_; }

private:
    void look(GroundProbe& probe) {
        constexpr int kLongEnough = 2000;
        const int k = ++answers_;
        if (click_after_ == 0 && (probe.last_hit(Ray::click).question > 0 || k > kLongEnough)) click_after_ = k;
        if (profile_after_ == 0 && (probe.last_profile() != nullptr || k > kLongEnough)) profile_after_ = k;
        if (click_after_ == 0 || profile_after_ == 0) (void)probe.height_m(lattice_.x_m(0.01 * k), lattice_.y_m(3));
        note_();
    }

    const Lattice lattice_;
    const std::function<void()> note_;
    std::atomic<GroundProbe*> probe_ = nullptr;
    std::atomic<int> answers_ = 0, click_after_ = 0, profile_after_ = 0;
};

TEST_F(Probe, NoKindWaitsForTheQuestionsOfAnother) {
    Mover mover(*store_, answers_.note());
    GroundProbe probe(store_, mover.on_answer());
    mover.begin(probe);
    store_->hold();
    (void)probe.height_m(place(1, 1).x, place(1, 1).y);
    store_->wait_for_reads(1);
    const auto click = cast_down(probe, Ray::click, 5, 5);
    probe.profile(place(0, 0), place(50, 50), 100);
    store_->release();
    ASSERT_TRUE(answered(probe, Ray::click, click));
    ASSERT_TRUE(answers_.wait([&] { return mover.profile_after() > 0; }));
    EXPECT_LE(mover.click_after(), 3);
    EXPECT_LE(mover.profile_after(), 20) << "read a few heights at a time in between";
    EXPECT_GT(mover.profile_after(), mover.click_after()) << "keeps nobody waiting to its end";
}

TEST_F(Probe, AProfileKeepsNobodyWaitingToItsEnd) {
    Mover mover(*store_, answers_.note());
    GroundProbe probe(store_, mover.on_answer());
    mover.begin(probe);
    store_->hold();
    probe.profile(place(0, 0), place(255, 255), 4096);
    store_->wait_for_reads(1);
    const auto click = cast_down(probe, Ray::click, 5, 5);
    store_->release();
    ASSERT_TRUE(answered(probe, Ray::click, click));
    ASSERT_TRUE(answers_.wait([&] { return mover.profile_after() > 0; }));
    EXPECT_EQ(mover.click_after(), 1);
    EXPECT_GT(mover.profile_after(), 50);
}

TEST_F(Probe, ADamagedStoreIsNoGround) {
    for (const TileId id : terrain_.tiles())
        if (id.level == terrain_.lattice().deepest_level) store_->damage(TileKind::height, id, test::Damage::checksum);
    GroundProbe probe(store_, answers_.note());
    (void)probe.height_m(place(5, 5).x, place(5, 5).y);
    ASSERT_TRUE(answers_.wait([&] { return answers_.count() == 1; }));
    EXPECT_FALSE(probe.height_m(place(5, 5).x, place(5, 5).y));
    const auto click = cast_down(probe, Ray::click, 5, 5);
    probe.profile(place(0, 0), place(9, 9), 3);
    ASSERT_TRUE(answered(probe, Ray::click, click));
    EXPECT_FALSE(probe.last_hit(Ray::click).point);
    ASSERT_TRUE(answers_.wait([&] { return probe.last_profile() != nullptr; }));
    for (const auto& point : probe.last_profile()->points) EXPECT_FALSE(point.height_m);
}

/// Throws or fails wherever it can.
class BrokenStore final : public TileStore {
public:
    BrokenStore(const Dataset& dataset, bool opens) : dataset_(dataset), opens_(opens) {}
    const Dataset& dataset() const override { return dataset_; }
    Result<std::unique_ptr<TileReader>> open_reader() const override {
        if (!opens_) return Error{ErrorCode::io, "cannot be opened"};
        return std::unique_ptr<TileReader>(new Reader);
    }

private:
    class Reader final : public TileReader {
    public:
        Result<bool> read(TileKind, TileId, TileRow&) override { throw std::bad_alloc(); }
    };
    const Dataset& dataset_;
    bool opens_;
};

TEST_F(Probe, AStoreThatThrowsOrDoesNotOpenIsNoGround) {
    for (const bool opens : {true, false}) {
        GroundProbe probe(std::make_shared<BrokenStore>(terrain_.dataset(), opens), answers_.note());
        (void)probe.height_m(place(5, 5).x, place(5, 5).y);
        const auto click = cast_down(probe, Ray::click, 5, 5);
        ASSERT_TRUE(answered(probe, Ray::click, click));
        EXPECT_FALSE(probe.last_hit(Ray::click).point);
        // And goes on with one that does.
        probe.use(store_);
        ASSERT_TRUE(answers_.wait([&] { return probe.height_m(place(5, 5).x, place(5, 5).y).has_value(); }));
    }
    GroundProbe none(nullptr, answers_.note());
    const auto click = cast_down(none, Ray::click, 5, 5);
    ASSERT_TRUE(answered(none, Ray::click, click));
}

TEST_F(Probe, AnotherStoreIsAskedAnewAndTheOldAnswersAreForgotten) {
    const test::SyntheticTerrain other = hills(10);
    const auto after = std::make_shared<test::MemoryStore>(other);
    GroundProbe probe(store_, answers_.note());
    const glm::dvec2 p = place(33, 44);
    (void)probe.height_m(p.x, p.y);
    cast_down(probe, Ray::cursor, 33, 44);
    cast_down(probe, Ray::click, 33, 44);
    probe.profile(p, p, 2);
    ASSERT_TRUE(answers_.wait([&] { return answers_.count() == 4; }));
    after->hold();
    probe.use(after);
    EXPECT_FALSE(probe.height_m(p.x, p.y));
    EXPECT_EQ(probe.last_hit(Ray::cursor).question, 0u);
    EXPECT_EQ(probe.last_hit(Ray::click).question, 0u);
    EXPECT_EQ(probe.last_profile(), nullptr);
    after->release();
    ASSERT_TRUE(answers_.wait([&] { return answers_.count() == 7; }));
    EXPECT_NEAR(*probe.height_m(p.x, p.y), other.height_m(33, 44), 1e-9);
    EXPECT_NEAR(probe.last_hit(Ray::cursor).point->z, other.height_m(33, 44), 1e-6);
    EXPECT_EQ(probe.last_hit(Ray::click).question, 0u) << "a click that was answered is not made again";
    EXPECT_NEAR(*probe.last_profile()->points[1].height_m, other.height_m(33, 44), 1e-9);
    probe.use(after);
    EXPECT_TRUE(probe.height_m(p.x, p.y)) << "the same store: nothing is forgotten";
}

TEST_F(Probe, AnAnswerOfAStoreThatWasLeftIsDropped) {
    const test::SyntheticTerrain other = hills(10);
    const auto after = std::make_shared<test::MemoryStore>(other);
    GroundProbe probe(store_, answers_.note());
    store_->hold();
    const auto click = cast_down(probe, Ray::click, 33, 44);
    store_->wait_for_reads(1);
    probe.use(after);
    store_->release();
    ASSERT_TRUE(answered(probe, Ray::click, click)) << "a click under way is asked of the new store";
    EXPECT_NEAR(probe.last_hit(Ray::click).point->z, other.height_m(33, 44), 1e-6);
    EXPECT_EQ(answers_.count(), 1);
}

TEST_F(Probe, AHeightOfAStoreThatWasLeftIsDropped) {
    const test::SyntheticTerrain other = hills(10);
    const auto after = std::make_shared<test::MemoryStore>(other);
    GroundProbe probe(store_, answers_.note());
    const glm::dvec2 p = place(33, 44);
    store_->hold();
    after->hold();
    (void)probe.height_m(p.x, p.y);
    store_->wait_for_reads(1);
    probe.use(after);
    store_->release();
    after->wait_for_reads(1);
    EXPECT_FALSE(probe.height_m(p.x, p.y));
    EXPECT_EQ(answers_.count(), 0);
    after->release();
    ASSERT_TRUE(answers_.wait([&] { return probe.height_m(p.x, p.y).has_value(); }));
    EXPECT_NEAR(*probe.height_m(p.x, p.y), other.height_m(33, 44), 1e-9);
}

TEST_F(Probe, NothingIsAnsweredAfterItsEnd) {
    std::atomic<bool> gone = false, late = false;
    auto probe = std::make_unique<GroundProbe>(store_, [&] { late = late || gone; });
    store_->hold();
    cast_down(*probe, Ray::click, 1, 1);
    store_->wait_for_reads(1);
    std::thread release([&] { store_->release(); });
    probe.reset();
    gone = true;
    release.join();
    EXPECT_FALSE(late);
}

class SlowProbe : public Probe {
protected:
    SlowProbe() : Probe(300) {}
};

TEST_F(SlowProbe, ManyThreadsAskAtOnceAndTheLastOfEachKindIsAnswered) {
    SCREE_TRACE_SEED();
    const auto other = std::make_shared<test::MemoryStore>(terrain_, 300);
    GroundProbe probe(store_, answers_.note());
    std::vector<std::thread> threads;
    for (std::uint64_t t = 0; t < 6; ++t)
        threads.emplace_back([&, t] {
            test::Random random(test::seed() + t);
            for (int k = 0; k < 200; ++k) {
                const int i = test::uniform(random, -20, 280), j = test::uniform(random, -20, 280);
                const glm::dvec2 p = place(i, j);
                (void)probe.height_m(p.x, p.y);
                const auto which = static_cast<Ray>(test::uniform(random, 0, 2));
                probe.cast(which, {p, 900}, {test::uniform_real(random, -1, 1), 0.4, -0.5}, 1e-6);
                (void)probe.last_hit(which);
                if (k % 20 == 0) probe.profile(p, place(j, i), 40);
                (void)probe.last_profile();
                if (k % 50 == 49) probe.use(k % 100 == 99 ? store_ : other);
            }
        });
    for (std::thread& thread : threads) thread.join();
    const glm::dvec2 p = place(17, 31);
    const auto cursor = cast_down(probe, Ray::cursor, 17, 31), click = cast_down(probe, Ray::click, 17, 31),
               middle = cast_down(probe, Ray::middle, 17, 31);
    probe.profile(p, p, 2);
    ASSERT_TRUE(answers_.wait([&] {
        const auto height_m = probe.height_m(p.x, p.y);
        const auto profile = probe.last_profile();
        return height_m && std::abs(*height_m - height(17, 31)) < 1e-9 && profile && profile->from_m == p &&
               probe.last_hit(Ray::cursor).question == cursor && probe.last_hit(Ray::click).question == click &&
               probe.last_hit(Ray::middle).question == middle;
    }));
    for (const Ray ray : {Ray::cursor, Ray::click, Ray::middle})
        EXPECT_NEAR(probe.last_hit(ray).point->z, height(17, 31), 1e-6);
}

}  // namespace
}  // namespace scree
