//! Small files of every kind, by hand from their makers' descriptions.

use std::f64::consts::PI;

use super::*;

fn capture(text: &str, options: &Options) -> Result<Capture, CaptureError> {
    let file = tempfile::Builder::new().suffix(".csv").tempfile().unwrap();
    std::fs::write(file.path(), text).unwrap();
    read(file.path(), options)
}

fn close(a: [f64; 3], b: [f64; 3]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6), "{a:?} for {b:?}");
}

/// Rotation vector of a body's frame.
fn turned(body: &Body, frame: usize) -> [f64; 3] {
    crate::backbone::rotation_vector(hal_sim::body::coordinates::rotation(body.orientation[frame].unwrap()))
}

#[test]
fn motive_with_its_y_up() {
    let half = (0.25 * PI).sin();
    let text = format!(
        "Format Version,1.23,Take Name,a,Capture Frame Rate,100.000000,Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global\n\n\
         ,,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body Marker\n\
         ,,tip,tip,tip,tip,tip,tip,tip,tip,tip:1\n,,A1,A1,A1,A1,A1,A1,A1,A1,A2\n\
         ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error,Position\n\
         Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X\n\
         0,0.00,0,0,0,1,10,20,30,0.1,1\n1,0.01,0,{half},0,{half},10,20,30,0.1,1\n2,0.02,,,,,,,,,\n"
    );
    let read = capture(&text, &Options::default()).unwrap();
    assert_eq!(read.format, "Motive");
    let body = read.body(Some("tip")).unwrap();
    assert_eq!(body.t_s, [0.0, 0.01, 0.02]);
    // Its y is our z, its z our −y.
    close(body.position[0], [0.01, -0.03, 0.02]);
    close(turned(body, 1), [0.0, 0.0, 0.5 * PI]);
    assert_eq!(body.orientation[2], None);
    let lying = capture(&text, &Options { up: Some(Up::Z), ..Options::default() }).unwrap();
    close(turned(&lying.bodies[0], 1), [0.0, 0.5 * PI, 0.0]);
    let euler = capture(&text.replace("Quaternion", "XYZ"), &Options::default()).unwrap_err().to_string();
    assert!(euler.contains("line 1") && euler.contains("quaternions"), "{euler}");
}

#[test]
fn nexus_with_rotation_vectors_in_degrees() {
    let text = "Segments\n200\n,,Robot:Base,,,,,,Robot:Tip\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ,RX,RY,RZ,TX,TY,TZ\n\
                ,,deg,deg,deg,mm,mm,mm,deg,deg,deg,mm,mm,mm\n11,0,0,0,0,0,0,0,0,0,30,1,2,3\n12,0,0,0,0,0,0,0,,,,,,\n";
    let read = capture(text, &Options::default()).unwrap();
    let tip = read.body(Some("Robot:Tip")).unwrap();
    assert!((tip.t_s[1] - 0.005).abs() < 1e-12 && tip.orientation[1].is_none());
    close(tip.position[0], [1e-3, 2e-3, 3e-3]);
    close(turned(tip, 0), [0.0, 0.0, PI / 6.0]);
    assert!(read.body(None).unwrap_err().to_string().contains("Robot:Base, Robot:Tip"));
}

#[test]
fn qtm_with_its_matrix_by_columns() {
    let row = "10\t20\t30\t0\t0\t90\t0.1\t0\t1\t0\t-1\t0\t0\t0\t0\t1";
    let lost = ["0"; 16].join("\t");
    let text = format!(
        "NO_OF_FRAMES\t2\nFREQUENCY\t100\nBODY_NAMES\trobot\n\
         X\tY\tZ\tRoll\tPitch\tYaw\tResidual\tRot[0]\tRot[1]\tRot[2]\tRot[3]\tRot[4]\tRot[5]\tRot[6]\tRot[7]\tRot[8]\n{row}\n{lost}\n"
    );
    let read = capture(&text, &Options::default()).unwrap();
    close(turned(&read.bodies[0], 0), [0.0, 0.0, 0.5 * PI]);
    close(read.bodies[0].position[0], [0.01, 0.02, 0.03]);
    assert!(read.bodies[0].orientation[1].is_none() && read.bodies[0].position[1][0].is_nan());
}

#[test]
fn points_of_tracker_and_deep_lab_cut() {
    let text = "mass A,,,mass B,\nt,x,y,x,y\n0,1,2,3,4\n0.04,1.5,2,,\n";
    let read = capture(text, &Options { metres: Some(0.01), ..Options::default() }).unwrap();
    assert_eq!((read.format, read.bodies.len()), ("Tracker", 2));
    close(read.body(Some("mass B")).unwrap().position[0], [0.03, 0.04, 0.0]);
    let text = "scorer,net,net,net\nbodyparts,nose,nose,nose\ncoords,x,y,likelihood\n0,100,50,0.99\n1,101,50,0.2\n";
    let options = Options { rate_hz: Some(50.0), metres: Some(1e-3), ..Options::default() };
    let read = capture(text, &options).unwrap();
    close(read.bodies[0].position[0], [0.1, -0.05, 0.0]);
    assert!(read.bodies[0].position[1][0].is_nan(), "a part that the net is not sure of is lost");
    assert!(capture(text, &Options::default()).unwrap_err().to_string().contains("--rate"));
}

#[test]
fn any_table_by_its_columns() {
    let text = "Time;Bend\n0;3\n10;\n20;-3\n";
    let columns = [("t_ms", "Time"), ("angle_z_deg", "Bend")].map(|(own, theirs)| (own.to_owned(), theirs.to_owned()));
    let read = capture(text, &Options { columns: columns.to_vec(), ..Options::default() }).unwrap();
    let body = read.body(None).unwrap();
    assert_eq!(body.t_s, [0.0, 0.01, 0.02]);
    close(turned(body, 0), [0.0, 0.0, 3.0 * PI / 180.0]);
    assert!(body.orientation[1].is_none());
    for (text, words) in [
        ("t_s,yaw_deg\n0,1\n0,2\n", "frame 2: its time does not increase"),
        ("t_s,yaw_deg\n0,1\n1,x\n", "line 3, column `yaw_deg`: `x` is not a number"),
        ("yaw_deg\n0\n1\n", "there is no time"),
        ("a,b\n0,1\n1,2\n", "no column of a pose"),
        ("t_s,qw,qx,qy,qz\n0,2,0,0,0\n1,1,0,0,0\n", "no unit quaternion"),
    ] {
        let said = capture(text, &Options::default()).unwrap_err().to_string();
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn a_walk_is_seen_from_its_first_pose() {
    let text = "t_s,x_m,y_m,yaw_deg\n0,1,1,90\n1,1,1.5,100\n2,0.9,1.5,90\n";
    let poses = capture(text, &Options::default()).unwrap().bodies[0].poses();
    close(poses[1].unwrap(), [0.5, 0.0, PI / 18.0]);
    close(poses[2].unwrap(), [0.5, 0.1, 0.0]);
}
