// A scene of the recursive ray tracing assignment, for POV-Ray 3.7
// Run: povray +Iscene.pov +Oscene.png +W64 +H48 -A -D -P +FN16 File_Gamma=1.0 +WT2
// The colours are linear: no gamma. Coordinates are the assignment's, times Unit.
// The scene as the assignment writes it:
//
//   255 255 255
//   0.1
//   2
//   250 200 0
//   50 -70 300
//   30
//   1
//   0.2
//   255 100 0
//   -60 -40 300
//   60
//   1
//   0.2
//   2
//   183 105 106
//   0 -100 0
//   0 1 0
//   0.5
//   1
//   10 10 10
//   0 -100 800
//   0 0 -1
//   1
//   0.5

#version 3.7;
#declare Unit = 0.1;

global_settings {
  assumed_gamma 1.0
  max_trace_level 4  // the primary ray and 3 bounces
  adc_bailout 0             // no bounce is dropped for being faint
  ambient_light rgb <0.099609375, 0.099609375, 0.099609375>  // ambient colour * coefficient / 256
}
background { rgb 0 }
camera {
  perspective
  location 0
  direction 100.0*z
  up 100.0*y
  right 100.0*x
}
light_source { <500.0, 500.0, 500.0>*Unit, rgb 1 }

// sphere 1
sphere { <50.0, -70.0, 300.0>*Unit, 30.0*Unit
  texture { pigment { rgb <250.0, 200.0, 0.0>/255 } finish { ambient 1 diffuse 1.0 specular 0 phong 0 reflection { 0.2 } } }
  interior_texture { pigment { rgb <250.0, 200.0, 0.0>/255 } finish { ambient 1 diffuse 0, 1.0 specular 0 phong 0 reflection { 0.2 } } }
}

// sphere 2
sphere { <-60.0, -40.0, 300.0>*Unit, 60.0*Unit
  texture { pigment { rgb <255.0, 100.0, 0.0>/255 } finish { ambient 1 diffuse 1.0 specular 0 phong 0 reflection { 0.2 } } }
  interior_texture { pigment { rgb <255.0, 100.0, 0.0>/255 } finish { ambient 1 diffuse 0, 1.0 specular 0 phong 0 reflection { 0.2 } } }
}

// plane 1
plane { <0.0, 1.0, 0.0>, -100.0*Unit
  texture { pigment { rgb <183.0, 105.0, 106.0>/255 } finish { ambient 1 diffuse 0.5 specular 0 phong 0 reflection { 1.0 } } }
  interior_texture { pigment { rgb <183.0, 105.0, 106.0>/255 } finish { ambient 1 diffuse 0, 0.5 specular 0 phong 0 reflection { 1.0 } } }
}

// plane 2
plane { <0.0, 0.0, -1.0>, -800.0*Unit
  texture { pigment { rgb <10.0, 10.0, 10.0>/255 } finish { ambient 1 diffuse 1.0 specular 0 phong 0 reflection { 0.5 } } }
  interior_texture { pigment { rgb <10.0, 10.0, 10.0>/255 } finish { ambient 1 diffuse 0, 1.0 specular 0 phong 0 reflection { 0.5 } } }
}
