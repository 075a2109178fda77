//! `scram completions`

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::{Cli, Done, print};

/// Print what a shell needs to complete scram's commands and options
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    scram completions bash > ~/.local/share/bash-completion/completions/scram\n  \
    scram completions zsh > ~/.zfunc/_scram")]
pub struct Completions {
    /// For which shell
    shell: Shell,
}

impl Completions {
    pub fn run(&self) -> Done {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "scram", &mut script);
        print(String::from_utf8_lossy(&script).trim_end());
        Ok(())
    }
}
