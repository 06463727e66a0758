// Threads that work on one problem together. The work is cut into the same parts for any number of
// them, and sums of parts are made in one order, so that they get the same bits.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#ifndef __wasm__
#include <thread>
#endif
#include <vector>

namespace nscd {

// More threads have nothing to do: crowds are cut into so many parts at most.
inline constexpr int MOST_THREADS = 16;

// Let others work while looking at a number that they change.
inline void pause(int polls) {
    if (polls < 100) {
#if defined(__x86_64__) || defined(__i386__)
        __builtin_ia32_pause();
#endif
    } else {
#ifndef __wasm__
        std::this_thread::yield();
#endif
    }
}

inline void wait_for(const std::atomic<int>& value, int target) {
    for (int polls = 0; value.load(std::memory_order_acquire) < target; ++polls) pause(polls);
}

#ifdef __wasm__
// One thread alone.
class Team {
public:
    explicit Team(int) {}
    int threads() const { return 1; }
    void run(const std::function<void(int)>& work) { work(0); }
    void meet(int) {}
};
#else
class Team {
public:
    explicit Team(int threads) : threads_(std::clamp(threads, 1, MOST_THREADS)) {
        for (int me = 1; me < threads_; ++me) others_.emplace_back([this, me] { serve(me); });
    }
    ~Team() {
        home_ = true;
        job_.fetch_add(1, std::memory_order_release);
    }  // each jthread is joined
    Team(const Team&) = delete;
    Team& operator=(const Team&) = delete;

    int threads() const { return threads_; }

    // Call work(number of the thread) in all of them; back when all have ended. It must not throw.
    void run(const std::function<void(int)>& work) {
        if (threads_ == 1) return work(0);
        work_ = &work;
        left_.store(0, std::memory_order_relaxed);
        met_.store(0, std::memory_order_relaxed);
        job_.fetch_add(1, std::memory_order_release);
        work(0);
        wait_for(left_, threads_ - 1);
    }

    // Within a job: wait for all threads to have come here so many times.
    void meet(int times) {
        if (threads_ == 1) return;
        met_.fetch_add(1, std::memory_order_acq_rel);
        wait_for(met_, times * threads_);
    }

private:
    void serve(int me) {
        for (int jobs = 1;; ++jobs) {
            wait_for(job_, jobs);
            if (home_) return;
            (*work_)(me);
            left_.fetch_add(1, std::memory_order_release);
        }
    }

    int threads_;
    bool home_ = false;
    const std::function<void(int)>* work_ = nullptr;
    alignas(64) std::atomic<int> job_{0};
    alignas(64) std::atomic<int> left_{0};
    alignas(64) std::atomic<int> met_{0};
    std::vector<std::jthread> others_;  // last: joined before what they look at goes
};
#endif

}  // namespace nscd
