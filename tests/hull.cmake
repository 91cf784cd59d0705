fivepipe_test(hull_exact_test hull_exact.cpp LINK fivepipe_hull)
