foreach(part pacing segmentation undistortion synthetic sources pipeline footage seated4cam)
  fivepipe_test(capture_${part}_test capture_${part}.cpp LINK fivepipe_capture)
endforeach()
