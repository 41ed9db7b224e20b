//! What the panel beside the picture offers.

use super::program::Folder;
use super::server::{Server, wait_for};
use super::window::{TIES, Window};

#[test]
fn what_the_panel_offers_is_done() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let window = Window::open(&server, &folder, &["s.isp", "-c", "0.2"]);
    window.point(400, 250);
    let whole = window.picture();
    let (_, n_triangles) = window.seen();

    // Half of the ball is gone, and one looks into it: everything stays where it is.
    window.click(746, 159);
    let clipped = window.picture();
    assert!(clipped.difference(&whole) > 0.05, "the plane cuts");
    assert!(clipped.covered() < whole.covered(), "and leaves less");
    window.click(746, 159);
    assert!(window.picture() == whole, "without the plane all is as before");

    // The second surface is that of -0.2, a larger ball around the first.
    window.click(746, 214);
    wait_for("two surfaces", || (window.seen().1 > n_triangles).then_some(()));
    let both = window.picture();
    assert!(both.covered() > 1.1 * whole.covered(), "the larger ball is seen");
    // To the middle of the slider of opacity; one looks through the one at the other.
    window.drag(1, (833, 81), (790, 81));
    assert!(window.picture().difference(&both) > 0.05, "one looks through");
    window.drag(1, (790, 81), (850, 81));
    assert!(window.picture().difference(&both) < TIES, "opaque again");
    window.click(746, 214);
    wait_for("one surface", || (window.seen().1 == n_triangles).then_some(()));

    window.click(746, 104);
    let dark = window.picture();
    assert!(dark.pixels[0].iter().all(|&c| c < 64), "dark: {:?}", dark.pixels[0]);
    window.click(746, 104);

    window.click(850, 104);
    let parallel = window.picture();
    // What is nearer than the middle of the ball is not larger any more.
    let share = parallel.covered() / whole.covered();
    assert!(parallel.difference(&whole) > 0.005 && share < 0.995, "{share} in parallel projection");
    window.click(850, 104);
    assert!(window.picture() == whole, "in perspective all is as before");

    window.click(872, 301);
    wait_for("the mesh", || folder.names().contains(&"s-0.2.ply".to_owned()).then_some(()));
    folder.run(&["extract", "s.isp", "-c", "0.2", "-o", "m.ply"]);
    assert!(folder.read("s-0.2.ply") == folder.read("m.ply"), "the mesh is what extract writes");

    window.click(766, 347);
    let last = folder.path().join("s-sweep").join("s-00100.png");
    wait_for("the last picture of the sweep", || last.exists().then_some(()));
    window.wait_for_isovalue(|c| c == 0.2);
    let frames = std::fs::read_dir(folder.path().join("s-sweep")).expect("a folder").count();
    assert_eq!(frames, 100);
}
