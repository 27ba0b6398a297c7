//! Prints `configs/shells/standard.toml`.

fn main() {
    let shells = locoman_vision::shells::design::standard();
    print!("{}", locoman_vision::shells::design::to_toml(&shells));
}
