#include "common/base/containers/bounded_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <memory>
#include <thread>
#include <vector>

namespace fivepipe::base {
namespace {

TEST(BoundedQueue, ReturnsItemsInTheOrderOfTheirPushes) {
  BoundedQueue<int> queue(3);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(queue.try_push(i));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(queue.pop(), i);
}

TEST(BoundedQueue, RefusesItemsOnceItIsFull) {
  BoundedQueue<int> queue(2);
  EXPECT_TRUE(queue.try_push(0));
  EXPECT_TRUE(queue.try_push(1));
  EXPECT_FALSE(queue.try_push(2));
  EXPECT_EQ(queue.size(), 2u);
  EXPECT_EQ(queue.cost(), 2u);
}

TEST(BoundedQueue, AcceptsAnItemOfAnyCostBelowTheLimit) {
  BoundedQueue<int> queue(10);
  EXPECT_TRUE(queue.try_push(0, 9));
  EXPECT_TRUE(queue.try_push(1, 1000));
  EXPECT_FALSE(queue.try_push(2, 0));
  EXPECT_EQ(queue.cost(), 1009u);
}

TEST(BoundedQueue, CountsTheItemInProgressUntilTheNextPop) {
  BoundedQueue<int> queue(1);
  EXPECT_TRUE(queue.try_push(7));
  EXPECT_EQ(queue.pop(), 7);
  EXPECT_EQ(queue.size(), 0u);
  EXPECT_EQ(queue.cost(), 1u);
  EXPECT_FALSE(queue.try_push(8));
  std::thread producer([&] { EXPECT_TRUE(queue.push(9)); });
  EXPECT_EQ(queue.pop(), 9);
  producer.join();
}

TEST(BoundedQueue, CloseRefusesNewItemsAndKeepsQueuedOnes) {
  BoundedQueue<int> queue(5);
  queue.push(1);
  queue.push(2);
  queue.close();
  EXPECT_FALSE(queue.try_push(3));
  EXPECT_FALSE(queue.push(3));
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_EQ(queue.pop(), 2);
  EXPECT_EQ(queue.pop(), std::nullopt);
  EXPECT_EQ(queue.pop(), std::nullopt);
  EXPECT_EQ(queue.cost(), 0u);
}

TEST(BoundedQueue, CloseReleasesAWaitingProducerAndConsumer) {
  BoundedQueue<int> full(1), empty(1);
  full.push(1);
  std::thread producer([&] { EXPECT_FALSE(full.push(2)); });
  std::thread consumer([&] { EXPECT_EQ(empty.pop(), std::nullopt); });
  full.close();
  empty.close();
  producer.join();
  consumer.join();
}

TEST(BoundedQueue, ClearReturnsQueuedItemsAndKeepsTheOneInProgress) {
  BoundedQueue<std::unique_ptr<int>> queue(100);
  for (int i = 0; i < 3; ++i) queue.push(std::make_unique<int>(i), 10);
  const auto in_progress = queue.pop();
  const auto dropped = queue.clear();
  ASSERT_EQ(dropped.size(), 2u);
  EXPECT_EQ(*dropped[0], 1);
  EXPECT_EQ(*dropped[1], 2);
  EXPECT_EQ(queue.cost(), 10u);
  EXPECT_EQ(queue.size(), 0u);
}

TEST(BoundedQueue, WaitsForFullAndClosed) {
  BoundedQueue<int> queue(2);
  queue.push(1);
  std::thread producer([&] { queue.push(2); });
  queue.wait_until_full_or_closed();
  EXPECT_EQ(queue.cost(), 2u);
  producer.join();
  queue.clear();
  std::thread closer([&] { queue.close(); });
  queue.wait_until_full_or_closed();
  closer.join();
}

// The queue is full as long as an item is in progress, so the producer waits for each pop().
TEST(BoundedQueue, PopReleasesAProducerThatWaitsForTheItemInProgress) {
  BoundedQueue<int> queue(1);
  std::thread producer([&] {
    for (int i = 0; i < 300; ++i) EXPECT_TRUE(queue.push(i));
  });
  for (int i = 0; i < 300; ++i) ASSERT_EQ(queue.pop(), i);
  producer.join();
}

TEST(BoundedQueue, ClearReleasesAWaitingProducer) {
  for (int round = 0; round < 20; ++round) {
    BoundedQueue<int> queue(1);
    queue.push(1);
    std::atomic<bool> pushes = false;
    std::thread producer([&] {
      pushes = true;
      EXPECT_TRUE(queue.push(2));
    });
    while (!pushes) std::this_thread::yield();
    for (int i = 0; i < 20; ++i) std::this_thread::yield();  // the producer waits in most rounds
    EXPECT_EQ(queue.clear(), std::deque<int>{1});
    producer.join();
    EXPECT_EQ(queue.clear(), std::deque<int>{2});
  }
}

TEST(BoundedQueue, DeliversEveryItemOfTwoProducersOnceAndInTheirOrder) {
  constexpr int kItems = 20'000;
  BoundedQueue<int> queue(8);
  std::thread even([&] {
    for (int i = 0; i < kItems; i += 2) EXPECT_TRUE(queue.push(i));
  });
  std::thread odd([&] {
    for (int i = 1; i < kItems; i += 2) EXPECT_TRUE(queue.push(i));
  });
  std::vector<int> next{0, 1};
  for (int n = 0; n < kItems; ++n) {
    const std::optional<int> item = queue.pop();
    ASSERT_TRUE(item);
    ASSERT_LE(queue.cost(), 8u);
    ASSERT_EQ(*item, next[std::size_t(*item % 2)]);
    next[std::size_t(*item % 2)] += 2;
  }
  even.join();
  odd.join();
  EXPECT_EQ(queue.size(), 0u);
}

}  // namespace
}  // namespace fivepipe::base
