"""What the lab is: readings, instruments, sensors, station, scene, reality gap, clocks."""
