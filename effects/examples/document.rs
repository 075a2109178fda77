//! Prints the catalogue as docs/effects.md has it below its marker.

fn main() {
    print!("{}", effects::markdown());
}
